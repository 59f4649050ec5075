//! Corruption of valid JSON: values of other files, extreme values, other types, missing or
//! additional entries.

use std::collections::BTreeMap;

use serde_json::{Map, Value, json};
use toml::de::{DeTable, DeValue};

use crate::bytes;
use crate::random::MangleRng;

/// Values of all files under each name, to replace values of the same name elsewhere.
#[derive(Default)]
pub struct Pool(BTreeMap<String, Vec<Value>>);

/// Words with a meaning in some place or in an expression.
const WORDS: [&str; 16] = [
    "",
    "../../secret.png",
    "/dev/zero",
    "file:///etc/hosts",
    "data:;base64,AAAA",
    "%00",
    "%",
    "(",
    ")",
    "^",
    "/0",
    "noise(",
    "if(x",
    ",",
    "-",
    "1e309",
];

impl Pool {
    /// Adds all small values of a tree.
    pub fn add(&mut self, value: &Value) {
        match value {
            Value::Array(list) => list.iter().for_each(|inner| self.add(inner)),
            Value::Object(map) => {
                for (key, inner) in map {
                    let kept = self.0.entry(key.clone()).or_default();
                    if kept.len() < 64 && inner.to_string().len() < 2000 && !kept.contains(inner) {
                        kept.push(inner.clone());
                    }
                    self.add(inner);
                }
            }
            _ => {}
        }
    }

    /// Returns a value from any file under this name.
    fn value(&self, key: &str, rng: &mut MangleRng) -> Option<Value> {
        self.0.get(key).map(|values| rng.choose(values).clone())
    }

    /// Returns a random name with a value.
    fn entry(&self, rng: &mut MangleRng) -> Option<(String, Value)> {
        let (key, values) = self.0.iter().nth(rng.below(self.0.len()))?;
        Some((key.clone(), rng.choose(values).clone()))
    }
}

/// Parses a TOML file into the equivalent JSON.
pub fn of_toml(text: &str) -> Option<Value> {
    DeTable::parse(text)
        .ok()
        .map(|table| of_table(table.get_ref()))
}

fn of_table(table: &DeTable<'_>) -> Value {
    table
        .iter()
        .map(|(key, value)| (key.get_ref().to_string(), of_value(value.get_ref())))
        .collect::<Map<_, _>>()
        .into()
}

fn of_value(value: &DeValue<'_>) -> Value {
    match value {
        DeValue::String(text) => json!(text),
        DeValue::Boolean(told) => json!(told),
        DeValue::Integer(digits) => {
            json!(i64::from_str_radix(digits.as_str(), digits.radix()).unwrap_or_default())
        }
        DeValue::Float(digits) => json!(digits.as_str().parse::<f64>().unwrap_or_default()),
        DeValue::Array(items) => items.iter().map(|item| of_value(item.get_ref())).collect(),
        DeValue::Table(table) => of_table(table),
        DeValue::Datetime(_) => Value::Null,
    }
}

/// Changes some values of a tree.
pub fn mangle(root: &mut Value, pool: &Pool, rng: &mut MangleRng) {
    for _ in 0..=rng.below(4) {
        descend(root, "", pool, rng);
    }
}

/// Descends along random branches to a value, and changes it.
fn descend(value: &mut Value, key: &str, pool: &Pool, rng: &mut MangleRng) {
    let stays = rng.below(6) == 0;
    match value {
        Value::Array(list) if !list.is_empty() && !stays => {
            let position = rng.below(list.len());
            descend(&mut list[position], key, pool, rng);
        }
        Value::Object(map) if !map.is_empty() && !stays => {
            let position = rng.below(map.len());
            if let Some((key, inner)) = map.iter_mut().nth(position) {
                descend(inner, key, pool, rng);
            }
        }
        _ => change(value, key, pool, rng),
    }
}

fn change(value: &mut Value, key: &str, pool: &Pool, rng: &mut MangleRng) {
    match (rng.below(8), &mut *value) {
        (0, _) => {
            *value = rng
                .choose(&[
                    json!(null),
                    json!(true),
                    json!([]),
                    json!({}),
                    json!("x"),
                    json!(7),
                    json!([[[[]]]]),
                ])
                .clone()
        }
        (1 | 2, _) => drop(pool.value(key, rng).map(|new| *value = new)),
        (_, Value::Number(number)) => *value = extreme(number.as_f64().unwrap_or(0.0), rng),
        (_, Value::String(text)) => string(text, rng),
        (_, Value::Array(list)) => array(list, rng),
        (_, Value::Object(map)) => object(map, pool, rng),
        (_, Value::Bool(told)) => *told = !*told,
        (_, Value::Null) => *value = json!(0),
    }
}

/// Returns a nearby, small, or extreme number.
fn extreme(number: f64, rng: &mut MangleRng) -> Value {
    match rng.below(6) {
        0 => json!(number as i64 + 1),
        1 => json!(number as i64 - 1),
        2 => json!(rng.below(12)),
        3 => json!(-number),
        4 => json!(*rng.choose(&[
            1u64 << 16,
            1 << 31,
            (1 << 32) - 1,
            1 << 32,
            1 << 62,
            u64::MAX
        ])),
        _ => json!(*rng.choose(&[1e-320, 1e-45, 1e-7, 0.5, 1e9, 1e20, 3.5e38, 1e308, -1e308])),
    }
}

fn string(text: &mut String, rng: &mut MangleRng) {
    match rng.below(4) {
        0 => *text = rng.choose(&WORDS).to_string(),
        1 => *text = text.repeat(1 + rng.below(40)),
        2 => {
            *text = rng
                .choose(&["(", "-", "1+", "a"])
                .repeat(1 << rng.below(14))
        }
        _ => {
            let mut bytes = text.clone().into_bytes();
            bytes::mangle(&mut bytes, rng);
            let position = rng.below(bytes.len());
            bytes.splice(position..position, rng.choose(&WORDS).bytes());
            *text = String::from_utf8_lossy(&bytes).into_owned();
        }
    }
}

fn array(list: &mut Vec<Value>, rng: &mut MangleRng) {
    let (a, b) = (rng.below(list.len()), rng.below(list.len()));
    match rng.below(6) {
        0 => list.clear(),
        1 if !list.is_empty() => drop(list.remove(a)),
        2 if !list.is_empty() => list.swap(a, b),
        3 if list.len() < 100 => list.extend(list.clone()),
        4 if list.len() < 100 => *list = vec![list.clone(); 1 + rng.below(20)].concat(),
        _ if !list.is_empty() => list.insert(a, list[b].clone()),
        _ => list.push(json!(0)),
    }
}

fn object(map: &mut Map<String, Value>, pool: &Pool, rng: &mut MangleRng) {
    let name = map
        .keys()
        .nth(rng.below(map.len()))
        .cloned()
        .unwrap_or_default();
    match rng.below(3) {
        0 => drop(map.remove(&name)),
        1 => drop(pool.entry(rng).map(|(key, value)| map.insert(key, value))),
        _ => {
            let inner = Value::Object(map.clone());
            map.insert(name, inner);
        }
    }
}
