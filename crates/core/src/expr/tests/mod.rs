//! Tests of the expression language: what it means, and what its programs compute.

mod language;
mod programs;

use std::collections::BTreeMap;

fn names() -> BTreeMap<String, f64> {
    BTreeMap::from([("t".to_owned(), 2.0), ("size".to_owned(), 0.5), ("long_name".to_owned(), 7.0)])
}
