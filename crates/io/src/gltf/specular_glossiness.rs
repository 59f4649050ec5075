//! KHR_materials_pbrSpecularGlossiness in terms of metallic-roughness, as far as its factors go.

use gltf::json::extensions::material::PbrSpecularGlossiness;
use raywright_core::scene::{Colour, Physical};

/// Reflectance at normal incidence of the dielectrics of the metallic-roughness model (index of refraction 1.5).
const DIELECTRIC: f64 = 0.04;

/// Sets base colour, metalness, roughness and opacity so that diffuse and mirrored light come out alike.
///
/// With base colour c and metalness m, metallic-roughness has a diffuse albedo of c·(1−m)·(1−0.04) and a reflectance of
/// 0.04·(1−m) + c·m. Set equal to diffuse·(1−max specular) and specular of the given material, taken by their means, these
/// give a quadratic in m; c follows for each channel from whichever part m favours.
pub(super) fn convert(source: &PbrSpecularGlossiness, out: &mut Physical) {
    let [r, g, b, alpha] = source.diffuse_factor.0.map(unit);
    let specular = source.specular_factor.0.map(unit);
    let strongest = specular.into_iter().fold(0.0, f64::max);
    let diffuse = [r, g, b].map(|c| c * (1.0 - strongest) / (1.0 - DIELECTRIC));
    let metallic = metalness(mean(diffuse), mean(specular));
    let channel = |i: usize| {
        let from_diffuse = diffuse[i] / (1.0 - metallic).max(1e-4);
        let from_specular = (specular[i] - DIELECTRIC * (1.0 - metallic)) / metallic.max(1e-4);
        let share = metallic * metallic;
        unit_f64(from_diffuse * (1.0 - share) + from_specular * share)
    };
    out.base_colour = Colour([channel(0), channel(1), channel(2)]).into();
    out.metallic = metallic.into();
    out.roughness = (1.0 - unit(source.glossiness_factor.0)).into();
    out.opacity = alpha.into();
}

/// The m of c·(1−m) = d and 0.04·(1−m) + c·m = s: with c taken from the first, 0.04·m² + (d + s − 0.08)·m + 0.04 − s = 0.
fn metalness(d: f64, s: f64) -> f64 {
    if s <= DIELECTRIC {
        return 0.0;
    }
    let (a, b, c) = (DIELECTRIC, d + s - 2.0 * DIELECTRIC, DIELECTRIC - s);
    unit_f64((-b + (b * b - 4.0 * a * c).max(0.0).sqrt()) / (2.0 * a))
}

fn mean(v: [f64; 3]) -> f64 {
    (v[0] + v[1] + v[2]) / 3.0
}

fn unit(value: f32) -> f64 {
    unit_f64(f64::from(value))
}

fn unit_f64(value: f64) -> f64 {
    if value.is_nan() { 0.0 } else { value.clamp(0.0, 1.0) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gltf::json::extensions::material::{PbrDiffuseFactor, PbrSpecularFactor};
    use gltf::json::material::StrengthFactor;
    use raywright_core::scene::ColourInput;

    fn converted(diffuse: [f32; 3], specular: [f32; 3]) -> ([f64; 3], f64) {
        let source = PbrSpecularGlossiness {
            diffuse_factor: PbrDiffuseFactor([diffuse[0], diffuse[1], diffuse[2], 1.0]),
            specular_factor: PbrSpecularFactor(specular),
            glossiness_factor: StrengthFactor(0.25),
            ..PbrSpecularGlossiness::default()
        };
        let mut out = Physical::default();
        convert(&source, &mut out);
        assert_eq!(out.roughness, 0.75.into());
        let ColourInput::Constant(Colour(base)) = out.base_colour else { panic!("a constant colour") };
        (base, out.metallic.constant().expect("a number"))
    }

    /// The two ends that have an exact counterpart: a plain dielectric and a pure metal.
    #[test]
    fn dielectrics_and_metals_convert_exactly() {
        let (base, metallic) = converted([0.5, 0.25, 0.125], [0.04; 3]);
        assert_eq!(metallic, 0.0);
        assert!(base.iter().zip([0.5, 0.25, 0.125]).all(|(a, b)| (a - b).abs() < 1e-6), "{base:?}");
        let (base, metallic) = converted([0.0; 3], [1.0, 0.75, 0.5]);
        assert!((metallic - 1.0).abs() < 1e-9, "{metallic}");
        assert!(base.iter().zip([1.0, 0.75, 0.5]).all(|(a, b)| (a - b).abs() < 1e-6), "{base:?}");
    }
}
