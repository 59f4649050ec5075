//! Textures of material libraries: options, file name, image.

use std::collections::{HashMap, HashSet};

use raywright_core::Scene;
use raywright_core::scene::{
    Colour, ColourSpace, Image, Texture, TextureFilter, TextureRef, WrapMode,
};

use super::lines::{normalise_path, split_first_word, strip_name_comment};
use crate::folder::Folder;
use crate::image_decode_queue::ImageDecodeQueue;
use crate::import::{
    DecodeBudget, Fault, ImportResult, UniqueNames, Warnings, catch_invalid_input,
};
use crate::text::parse_number_prefix;
use crate::warning::WarningCode;
use crate::{Limits, image_file};

/// A parsed texture statement of MTL: the path of the image, and the options.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TextureStatement {
    /// Path of the image.
    pub path: String,
    /// Whether texture coordinates outside 0..1 are clamped to the border of the image.
    pub clamp: bool,
    /// Factor on the texture coordinates u and v.
    pub scale: [f64; 2],
    /// Offset that is added to u and v after the factor.
    pub offset: [f64; 2],
    /// Factor on a bump or normal map (`-bm`).
    pub bump: f64,
}

/// Options of texture statements, each with its number of argument words. `0` marks an option with
/// one to three numbers.
const OPTIONS: [(&str, usize); 15] = [
    ("-blendu", 1),
    ("-blendv", 1),
    ("-bm", 1),
    ("-boost", 1),
    ("-cc", 1),
    ("-clamp", 1),
    ("-colorspace", 1),
    ("-imfchan", 1),
    ("-mm", 2),
    ("-texres", 1),
    ("-type", 1),
    ("-o", 0),
    ("-s", 0),
    ("-t", 0),
    ("-noise", 0),
];

impl TextureStatement {
    /// Parses `[options] file name [options]`; the name may contain blanks.
    pub fn parse(text: &str) -> Self {
        let mut map = Self {
            path: String::new(),
            clamp: false,
            scale: [1.0; 2],
            offset: [0.0; 2],
            bump: 1.0,
        };
        let mut rest = text.trim();
        while let Some(after) = map.parse_option(rest) {
            rest = after;
        }
        // Some programs write options after the name.
        let option = |at: &usize| {
            rest.get(*at..).is_some_and(|tail| {
                OPTIONS
                    .iter()
                    .any(|(name, _)| split_first_word(tail).0 == *name)
            })
        };
        let end = rest
            .match_indices(" -")
            .map(|(position, _)| position + 1)
            .find(option)
            .unwrap_or(rest.len());
        let (path, mut tail) = rest.split_at(end);
        while let Some(after) = map.parse_option(tail) {
            tail = after;
        }
        map.path = normalise_path(path);
        map
    }

    /// Parses an option and returns the text after the option; `None` if the text starts with no
    /// option.
    fn parse_option<'t>(&mut self, text: &'t str) -> Option<&'t str> {
        let (name, mut rest) = split_first_word(text);
        let (_, words) = OPTIONS.iter().find(|(option, _)| *option == name)?;
        let mut numbers = Vec::new();
        for _ in 0..if *words == 0 { 3 } else { *words } {
            let (word, after) = split_first_word(rest);
            let value = word
                .parse::<f64>()
                .ok()
                .filter(|_| parse_number_prefix(word).is_some());
            if *words == 0 && value.is_none() {
                break;
            }
            numbers.extend(value);
            if name == "-clamp" {
                self.clamp = word == "on";
            }
            rest = after;
        }
        let pair = |missing: f64| {
            [
                numbers.first().copied().unwrap_or(missing),
                numbers.get(1).copied().unwrap_or(missing),
            ]
        };
        match name {
            "-s" => self.scale = pair(1.0),
            "-o" => self.offset = pair(0.0),
            "-bm" => {
                self.bump = numbers
                    .first()
                    .copied()
                    .filter(|x| x.is_finite())
                    .unwrap_or(1.0)
            }
            _ => {}
        }
        Some(rest)
    }

    /// Returns the first two rows of the matrix that transforms the texture coordinates; `None` for
    /// the identity. The coordinate v counts from the top of the image.
    fn uv_transform(&self) -> Option<[[f64; 3]; 2]> {
        let ([su, sv], [ou, ov]) = (self.scale, self.offset);
        let finite = [su, sv, ou, ov].iter().all(|x| x.is_finite());
        // v' = 1 − (sv·(1 − v) + ov)
        (finite && (self.scale != [1.0; 2] || self.offset != [0.0; 2]))
            .then_some([[su, 0.0, ou], [0.0, sv, 1.0 - sv - ov]])
    }
}

/// Returns the paths at which an image may lie that a library in the folder `library` names:
/// relative to the library, then to the OBJ file, each also without a comment behind the path.
pub(super) fn image_candidates(library: &str, path: &str) -> Vec<String> {
    let names = [path, strip_name_comment(path)];
    let mut paths: Vec<String> = [library, ""]
        .iter()
        .flat_map(|folder| names.map(|name| format!("{folder}{name}")))
        .collect();
    paths.dedup();
    paths
}

/// Reads the images that the materials of a file use, and creates their textures.
pub(super) struct TextureLoader<'f> {
    folder: &'f Folder,
    limits: &'f Limits,
    /// Paths of the images that were read, by folder of the library and path in its statement.
    images: HashMap<(String, String), String>,
    /// Names of the textures, by path of the image, by whether the image holds colours, and by
    /// whether coordinates are clamped.
    textures: HashMap<(String, bool, bool), String>,
    names: UniqueNames,
}

impl<'f> TextureLoader<'f> {
    /// Creates a loader that has not read any image.
    pub fn new(folder: &'f Folder, limits: &'f Limits) -> Self {
        Self {
            folder,
            limits,
            images: HashMap::new(),
            textures: HashMap::new(),
            names: UniqueNames::default(),
        }
    }

    /// Reads and decodes the images of all statements, each with the folder of its library, before
    /// any material is created, because a material depends on whether its images exist. An
    /// unreadable image is a warning.
    ///
    /// # Errors
    /// A fault of kind limit for an oversized image.
    pub fn load<'s>(
        &mut self,
        statements: impl Iterator<Item = (&'s str, &'s str)>,
        scene: &mut Scene,
        budget: &mut DecodeBudget,
        warnings: &mut Warnings,
    ) -> ImportResult<()> {
        let mut waiting = ImageDecodeQueue::default();
        let warn = |reason: String| format!("texture: {reason}; the texture is left out");
        let (mut requested, mut accepted) = (HashSet::new(), HashSet::new());
        for (library, statement) in statements {
            let key = (library.to_owned(), TextureStatement::parse(statement).path);
            if !requested.insert(key.clone()) {
                continue;
            }
            match self.read_image(library, &key.1, &accepted, budget)? {
                Ok((path, bytes)) => {
                    self.images.insert(key, path.clone());
                    if accepted.insert(path.clone()) {
                        waiting.add_image(scene.images.len(), format!("`{path}`"), bytes.into());
                        scene.images.push(Image {
                            name: path.clone(),
                            path,
                            data: None,
                            mended: 0,
                        });
                    }
                }
                Err(reason) => warnings.add(WarningCode::Picture, warn(reason)),
            }
        }
        let report = waiting.decode_images(&mut scene.images, self.limits, &|| {})?;
        report
            .errors
            .into_iter()
            .for_each(|reason| warnings.add(WarningCode::Picture, warn(reason)));
        report
            .remarks
            .into_iter()
            .for_each(|(code, remark)| warnings.add(code, format!("texture: {remark}")));
        scene.images.retain(|image| image.data.is_some());
        let decoded: HashSet<&str> = scene.images.iter().map(|image| &*image.path).collect();
        self.images.retain(|_, path| decoded.contains(&**path));
        Ok(())
    }

    /// Reads the first image that exists among the candidates for a path. Returns the path of this
    /// image and its bytes, which are empty for an image that is `accepted` already; or the reason
    /// why the first candidate cannot be read.
    fn read_image(
        &self,
        library: &str,
        path: &str,
        accepted: &HashSet<String>,
        budget: &mut DecodeBudget,
    ) -> ImportResult<Result<(String, Vec<u8>), String>> {
        let mut failure = None;
        for path in image_candidates(library, path) {
            if accepted.contains(&path) {
                return Ok(Ok((path, Vec::new())));
            }
            let read = self.folder.read(&path).map_err(Fault::from);
            let read = read.and_then(|bytes| {
                image_file::reserve_picture_memory(&bytes, self.limits, budget)
                    .map_err(|fault| fault.with_place(format_args!("`{path}`")))?;
                Ok(bytes)
            });
            match catch_invalid_input(read)? {
                Ok(bytes) => return Ok(Ok((path, bytes))),
                Err(reason) => failure = failure.or(Some(reason)),
            }
        }
        Ok(Err(failure.unwrap_or_default()))
    }

    /// Returns a reference to the texture of a statement in a library of the folder `library`;
    /// `None` if the image was not read.
    pub fn texture_ref(
        &mut self,
        library: &str,
        statement: &str,
        space: ColourSpace,
        scene: &mut Scene,
    ) -> Option<TextureRef> {
        let map = TextureStatement::parse(statement);
        let image = self.images.get(&(library.to_owned(), map.path.clone()))?;
        let wrap = if map.clamp {
            WrapMode::Clamp
        } else {
            WrapMode::Repeat
        };
        let key = (image.clone(), space == ColourSpace::Srgb, map.clamp);
        let name = self.textures.entry(key).or_insert_with(|| {
            let name = self.names.make_unique(image);
            let texture = Texture {
                name: name.clone(),
                image: image.clone(),
                colour_space: space,
                filter: TextureFilter::Bilinear,
                wrap_u: wrap,
                wrap_v: wrap,
            };
            scene.textures.push(texture);
            name
        });
        let uv_transform = map.uv_transform();
        Some(TextureRef {
            name: name.clone(),
            uv_set: 0,
            uv: None,
            uv_transform,
            factor: Colour::WHITE,
            channel: None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: options precede or follow names, and names contain blanks.
    #[test]
    fn statements_are_taken_apart() {
        let map = |text: &str| {
            let map = TextureStatement::parse(text);
            (map.path, map.clamp, map.scale, map.offset)
        };
        let plain = |path: &str| (path.to_owned(), false, [1.0; 2], [0.0; 2]);
        assert_eq!(map("a b.png"), plain("a b.png"));
        assert_eq!(map("-bm 3 bump-map.jpg"), plain("bump-map.jpg"));
        assert_eq!(map("bump map -2.jpg -bm 1.5"), plain("bump map -2.jpg"));
        assert_eq!(map("-mm 0.1 0.3 x\\y.jpg"), plain("x/y.jpg"));
        assert_eq!(
            map("-clamp on -s 2 3 1 -o 0.5 c.png"),
            ("c.png".to_owned(), true, [2.0, 3.0], [0.5, 0.0])
        );
        assert_eq!(map("-s"), plain(""));
    }

    /// Protects: scale and offset apply to v from the bottom: the bottom-left texel of a doubled
    /// image stays at its corner.
    #[test]
    fn scale_keeps_the_bottom_left_corner() {
        let [u, v] = TextureStatement::parse("-s 2 2 x.png")
            .uv_transform()
            .unwrap();
        let at = |x: f64, y: f64| [u[0] * x + u[1] * y + u[2], v[0] * x + v[1] * y + v[2]];
        assert_eq!(at(0.0, 1.0), [0.0, 1.0]);
        assert_eq!(at(0.5, 0.5), [1.0, 0.0]);
    }

    /// Protects: an offset moves the lookup to the right and up for positive numbers, with v from
    /// the bottom.
    #[test]
    fn offsets_count_from_the_bottom() {
        let [u, v] = TextureStatement::parse("-o 0.25 0.125 x.png")
            .uv_transform()
            .unwrap();
        let at = |x: f64, y: f64| [u[0] * x + u[1] * y + u[2], v[0] * x + v[1] * y + v[2]];
        assert_eq!(at(0.0, 1.0), [0.25, 0.875]);
        assert_eq!(at(0.5, 0.5), [0.75, 0.375]);
    }
}
