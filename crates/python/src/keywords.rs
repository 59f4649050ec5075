//! Conversion of Python keywords to flags of the command line: `max_error=.05` is
//! `--max-error=0.05`.

use std::ffi::OsString;

use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyList, PyTuple};

/// Keywords whose names differ from their flags: the keyword, and the name of the flag.
const RENAMED: [(&str, &str); 3] = [
    ("layers", "aov"),
    ("rungs", "rung"),
    ("model_scene", "scene"),
];

/// Converts keywords to flags, in order. None and False omit the flag; True gives the flag without
/// a value. A dict gives the flag once for each entry, as `KEY=VALUE`. The items of a list are
/// separated by commas, or by an x for a size.
pub fn keywords_to_flags(keywords: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<OsString>> {
    let mut words = Vec::new();
    for (name, value) in keywords.into_iter().flatten() {
        let name: String = name.extract()?;
        let flag = RENAMED
            .iter()
            .find(|(own, _)| *own == name)
            .map_or(name.as_str(), |(_, flag)| flag)
            .replace('_', "-");
        if value.is_none() {
            continue;
        }
        if let Ok(switch) = value.cast::<PyBool>() {
            words.extend(switch.is_true().then(|| format!("--{flag}").into()));
        } else if let Ok(entries) = value.cast::<PyDict>() {
            for (key, value) in entries {
                words.push(format!("--{flag}={}={}", key.str()?, value.str()?).into());
            }
        } else {
            let mut word = OsString::from(format!("--{flag}="));
            word.push(format_value(
                &value,
                if flag == "size" { "x" } else { "," },
            )?);
            words.push(word);
        }
    }
    Ok(words)
}

/// Formats a value for the command line.
fn format_value(value: &Bound<'_, PyAny>, separator: &str) -> PyResult<OsString> {
    if value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>() {
        let parts = value
            .try_iter()?
            .map(|part| Ok(part?.str()?.to_string()))
            .collect::<PyResult<Vec<_>>>()?;
        return Ok(parts.join(separator).into());
    }
    match value.call_method0("__fspath__") {
        Ok(path) => path.extract(),
        Err(_) => Ok(value.str()?.to_string().into()),
    }
}
