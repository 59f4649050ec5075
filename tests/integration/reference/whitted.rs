//! The canonical preset against the shader that it comes from: every view, linear and display, ids, and the bounce study.

use raywright::core::picture::Picture;
use raywright::core::settings::{Aov, PrecisionChoice};

use super::{ACES_22, read, reference, render, share_beyond};

const VIEWS: [(&str, f64, [u32; 2]); 3] =
    [("t0_640x360", 0.0, [640, 360]), ("t2p5_640x360", 2.5, [640, 360]), ("t12_256x256", 12.0, [256, 256])];

/// The bounds of the reference: 1/255 on stable pixels for at most 0.05 % of them, 8/255 on all for at most 1.5 %.
fn check(what: &str, ours: &Picture, theirs: &Picture, stable: &dyn Fn(usize) -> bool) {
    let (tight, loose) = (share_beyond(ours, theirs, 1.0 / 255.0, stable), share_beyond(ours, theirs, 8.0 / 255.0, |_| true));
    eprintln!("{what}: {:.4} % of stable pixels off by > 1/255, {:.3} % of all by > 8/255", tight * 100.0, loose * 100.0);
    assert!(tight <= 0.0005, "{what}: {:.4} % of the stable pixels are off by more than 1/255", tight * 100.0);
    assert!(loose <= 0.015, "{what}: {:.3} % of all pixels are off by more than 8/255", loose * 100.0);
}

/// Protects: every rule and constant of the preset, in linear and display values, and which object each pixel sees.
fn views(precision: PrecisionChoice) {
    let Some(folder) = reference("whitted") else { return };
    for (name, t, size) in VIEWS {
        let folder = folder.join(name);
        let mask = read(&folder.join("stable.png"));
        let stable = |i: usize| mask.rgb[i][0] > 0.5;
        let ours = render("whitted", t, &[], |s| {
            s.size = size;
            s.precision = precision;
            s.aovs = vec![Aov::Object];
        })
        .picture;
        check(&format!("{name} linear"), &ours, &read(&folder.join("linear.exr")), &stable);
        check(&format!("{name} linear f64"), &ours, &read(&folder.join("linear_f64.exr")), &stable);
        check(&format!("{name} display"), &ACES_22.to_values(&ours), &read(&folder.join("final.exr")), &stable);
        let ids = |p: &Picture, layer: &str| p.layer(layer).unwrap_or_else(|| panic!("no layer {layer}")).samples.clone();
        let (ours, theirs) = (ids(&ours, "object.id"), ids(&read(&folder.join("aov.exr")), "object"));
        let judged = ours.iter().zip(&theirs).enumerate().filter(|(i, _)| stable(*i));
        let (wrong, all) = judged.fold((0, 0), |(wrong, all), (_, (a, b))| (wrong + u32::from(a != b), all + 1));
        assert!(f64::from(wrong) <= 1e-4 * f64::from(all), "{name}: {wrong} of {all} stable pixels see another object");
    }
}

#[test]
fn every_view_robust() {
    views(PrecisionChoice::Robust);
}

#[test]
fn every_view_fast() {
    views(PrecisionChoice::Fast);
}

#[test]
fn every_view_reference() {
    views(PrecisionChoice::Reference);
}

/// Protects: what `--max-depth` counts, and that the energy beyond it is dropped.
#[test]
fn bounce_study() {
    let Some(folder) = reference("whitted") else { return };
    for depth in [1, 2, 3, 4, 8] {
        let ours = render("whitted", 2.5, &[], |s| {
            s.size = [320, 180];
            s.max_depth = depth;
        });
        let theirs = read(&folder.join(format!("bounces_t2p5_320x180/linear_b{depth}.exr")));
        check(&format!("depth {depth}"), &ours.picture, &theirs, &|_| false);
    }
}
