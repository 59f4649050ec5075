//! Tests of the expression language: meaning, and results of compiled programs.

mod language;
mod oracle;
mod programs;

use std::collections::BTreeMap;

use glam::DVec3;

use super::VariableValues;

fn names() -> BTreeMap<String, f64> {
    BTreeMap::from([
        ("t".to_owned(), 2.0),
        ("size".to_owned(), 0.5),
        ("long_name".to_owned(), 7.0),
    ])
}

fn hit() -> VariableValues<f64> {
    VariableValues {
        p: DVec3::new(1.5, 2.5, -3.5),
        n: DVec3::Y,
        d: DVec3::new(0.6, -0.8, 0.0),
        r: DVec3::new(0.6, 0.8, 0.0),
        l: DVec3::Z,
        o: DVec3::new(0.0, 1.0, 2.0),
        u: 0.25,
        v: 0.75,
        distance: 5.0,
        occluder_distance: f64::INFINITY,
        shadow: 0.5,
    }
}

/// The same hit in f32.
fn narrow(hit: &VariableValues<f64>) -> VariableValues<f32> {
    let v = |v: DVec3| v.as_vec3();
    VariableValues {
        p: v(hit.p),
        n: v(hit.n),
        d: v(hit.d),
        r: v(hit.r),
        l: v(hit.l),
        o: v(hit.o),
        u: hit.u as f32,
        v: hit.v as f32,
        distance: hit.distance as f32,
        occluder_distance: hit.occluder_distance as f32,
        shadow: hit.shadow as f32,
    }
}
