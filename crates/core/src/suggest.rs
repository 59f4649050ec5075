//! The hint "did you mean": the known word that is most similar to an unknown word, or that means
//! the same as a word of another program.

/// Words of Blender, glTF, Mitsuba, three.js and shaders, in lower case and without `_`, followed by
/// our words for them. The first of ours that fits the place is meant; it may be a path.
const SYNONYMS: [(&str, &[&str]); 39] = [
    (
        "color basecolor albedo diffusecolor basecolorfactor reflectance kd",
        &[
            "base_colour",
            "colour",
            "constant",
            "model.physical.base_colour",
            "material",
        ],
    ),
    (
        "metalness metal metallicfactor",
        &["metallic", "model.physical.metallic"],
    ),
    (
        "roughnessfactor alphau glossiness smoothness",
        &["roughness", "model.physical.roughness"],
    ),
    (
        "shininess",
        &[
            "exponent",
            "roughness",
            "specular",
            "model.physical.roughness",
        ],
    ),
    (
        "emissive emissivecolor emissivefactor emissionstrength ke",
        &["emission", "model.physical.emission"],
    ),
    (
        "metallic roughness ior transmission opacity emission",
        &["model.physical", "material"],
    ),
    (
        "intior indexofrefraction refractiveindex eta",
        &["ior", "model.physical.ior"],
    ),
    (
        "transmissionfactor transparency",
        &["transmission", "opacity", "model.physical.transmission"],
    ),
    (
        "fov fovy yfov verticalfov cameraangle",
        &["vertical_fov", "projection.pinhole.vertical_fov"],
    ),
    (
        "fovx xfov horizontalfov",
        &["horizontal_fov", "projection.pinhole.horizontal_fov"],
    ),
    (
        "lens focal focallength",
        &["focal_length", "projection.pinhole.focal_length"],
    ),
    (
        "position location translation pos",
        &[
            "position",
            "eye",
            "centre",
            "translate",
            "transform",
            "pose.look_at.eye",
            "kind.point.position",
            "p",
        ],
    ),
    ("center", &["centre", "target"]),
    (
        "lookat to at focus",
        &["look_at", "target", "pose.look_at.target"],
    ),
    ("from origin camera eye", &["eye", "pose.look_at.eye"]),
    (
        "rotation rotationeuler quaternion orientation toworld",
        &["rotate", "transform"],
    ),
    (
        "intensity power energy irradiance radiance",
        &["colour", "strength", "emission"],
    ),
    ("background environment envmap world", &["sky"]),
    ("lamp emitter lights light", &["lights"]),
    (
        "spp samplesperpixel samplecount",
        &["samples", "render.samples"],
    ),
    ("resolution width", &["size", "render.size"]),
    (
        "bounces maxbounces depth maxdepth",
        &["max_depth", "render.max_depth"],
    ),
    ("geometry primitive type", &["shape", "kind", "model"]),
    ("bsdf mat", &["material", "materials"]),
    ("filename uri url src", &["path", "file"]),
    (
        "principled principledbsdf standard disney pbr metallicroughness",
        &["physical"],
    ),
    ("sun distant parallel", &["directional"]),
    ("perspective persp", &["pinhole"]),
    ("cube cuboid aabb", &["box"]),
    ("rect rectangle parallelogram", &["quad"]),
    // Names of shaders in expressions.
    ("itime time utime", &["t"]),
    ("pos position worldpos", &["p"]),
    ("normal nor", &["n"]),
    ("rd raydir direction", &["d"]),
    ("ro rayorigin", &["o"]),
    ("lerp", &["mix"]),
    ("frac", &["fract"]),
    ("fmod", &["mod"]),
    ("saturate", &["clamp"]),
];

/// Returns our word for a word of another program, if it `fits` the place; of a path, its first
/// step must fit.
pub fn find_synonym(wrong: &str, fits: impl Fn(&str) -> bool) -> Option<&'static str> {
    let wrong = normalize_word(wrong).replace('_', "");
    let mut ours = SYNONYMS
        .iter()
        .filter(|(words, _)| words.split(' ').any(|word| word == wrong))
        .flat_map(|(_, ours)| ours.iter().copied());
    ours.find(|word| fits(word.split('.').next().unwrap_or(word)))
}

/// Returns the candidate that is most similar to a mistyped word; `None` if none is similar. The
/// similarity limit is one edit per three characters, and one edit for shorter words. An edit
/// inserts, removes or replaces a character, or swaps two neighbours. Case does not count, nor does
/// the choice between `-`, `_` and space.
pub fn most_similar_word<'a>(
    wrong: &str,
    candidates: impl IntoIterator<Item = &'a str>,
) -> Option<&'a str> {
    // The time for an edit distance is the product of both lengths, and no mistyped word is longer
    // than this.
    const LONGEST: usize = 64;
    if wrong.len() > LONGEST {
        return None;
    }
    let wrong = normalize_word(wrong);
    let edits = (wrong.chars().count() / 3).max(1);
    candidates
        .into_iter()
        .filter(|candidate| candidate.len() <= LONGEST)
        .map(|candidate| {
            (
                strsim::damerau_levenshtein(&wrong, &normalize_word(candidate)),
                candidate,
            )
        })
        .filter(|(distance, candidate)| *distance <= edits && *distance < candidate.chars().count())
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}

/// Returns a word in lower case with `_` in place of `-` and space.
fn normalize_word(word: &str) -> String {
    word.chars()
        .map(|c| {
            if matches!(c, '-' | ' ') {
                '_'
            } else {
                c.to_ascii_lowercase()
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::most_similar_word;

    /// Protects: typing errors and other spellings find their word.
    #[test]
    fn typing_errors_and_other_spellings_find_their_word() {
        let words = ["colour", "centre", "radius", "vertical_fov", "u"];
        for (wrong, right) in [
            ("color", "colour"),
            ("center", "centre"),
            ("Radius", "radius"),
            ("RADIUS", "radius"),
            ("vertical-fov", "vertical_fov"),
        ] {
            assert_eq!(most_similar_word(wrong, words), Some(right), "{wrong}");
        }
    }

    /// Protects: a word far from every candidate gets no suggestion.
    #[test]
    fn what_is_not_near_gets_no_suggestion() {
        for wrong in ["banana", "x", "", &"radius".repeat(100)] {
            assert_eq!(
                most_similar_word(wrong, ["colour", "radius", "u"]),
                None,
                "{wrong}"
            );
        }
    }
}
