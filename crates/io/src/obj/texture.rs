//! Textures of material libraries: options, file name, image.

use std::collections::{HashMap, HashSet};

use raywright_core::scene::{
    Channel, Colour, ColourSpace, Image, Texture, TextureFilter, TextureRef, WrapMode,
};

use super::SceneBuilder;
use super::survey::{normalise_path, strip_name_comment};
use crate::image_decode_queue::ImageDecodeQueue;
use crate::image_file;
use crate::import::{Fault, FaultPlace, ImportResult, UniqueNames, catch_invalid_input};

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
    /// Channel of a map of numbers (`-imfchan`); red unless stated.
    pub channel: Option<Channel>,
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
    /// Parses a file name, which may contain blanks, with options before or after the name.
    pub fn parse(text: &str) -> Self {
        let mut map = Self {
            path: String::new(),
            clamp: false,
            scale: [1.0; 2],
            offset: [0.0; 2],
            bump: 1.0,
            channel: None,
        };
        let mut name = String::new();
        let mut words = text.split_inclusive(char::is_whitespace).peekable();
        while let Some(word) = words.next() {
            let option = OPTIONS.iter().find(|(option, _)| *option == word.trim());
            let Some((option, count)) = option else {
                name.push_str(word);
                continue;
            };
            let mut arguments = Vec::new();
            while let Some(word) = words.next_if(|word| {
                let word = word.trim();
                word.is_empty()
                    || arguments.len() < *count
                    || (*count == 0 && arguments.len() < 3 && word.parse::<f64>().is_ok())
            }) {
                arguments.extend(Some(word.trim()).filter(|word| !word.is_empty()));
            }
            map.set_option(option, &arguments);
        }
        map.path = normalise_path(&name);
        map
    }

    fn set_option(&mut self, option: &str, arguments: &[&str]) {
        let number = |i: usize, missing: f64| {
            let number = arguments.get(i).and_then(|word| word.parse().ok());
            number.filter(|x: &f64| x.is_finite()).unwrap_or(missing)
        };
        match option {
            "-s" => self.scale = [number(0, 1.0), number(1, 1.0)],
            "-o" => self.offset = [number(0, 0.0), number(1, 0.0)],
            "-bm" => self.bump = number(0, 1.0),
            "-clamp" => self.clamp = arguments == ["on"],
            "-imfchan" => {
                self.channel = match arguments {
                    ["g"] => Some(Channel::Green),
                    ["b"] => Some(Channel::Blue),
                    ["m"] => Some(Channel::Alpha),
                    _ => None,
                }
            }
            _ => {}
        }
    }

    /// Returns the first two rows of the matrix that transforms the texture coordinates; `None` for
    /// the identity. The coordinate v counts from the top of the image.
    fn uv_transform(&self) -> Option<[[f64; 3]; 2]> {
        let ([su, sv], [ou, ov]) = (self.scale, self.offset);
        // v' = 1 − (sv·(1 − v) + ov)
        (self.scale != [1.0; 2] || self.offset != [0.0; 2])
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

/// Names of the images and textures of a scene.
#[derive(Default)]
pub(super) struct TextureNames {
    /// Paths of the images that were read, by folder of the library and path in its statement.
    images: HashMap<(String, String), String>,
    /// Names of the textures, by path of the image, by whether the image holds colours, and by
    /// whether coordinates are clamped.
    textures: HashMap<(String, bool, bool), String>,
    names: UniqueNames,
}

impl SceneBuilder<'_> {
    /// Reads and decodes the images of all statements, each with the folder of its library, before
    /// any material is created, because a material depends on whether its images exist. An
    /// unreadable image is a warning.
    ///
    /// # Errors
    /// A fault of kind limit for an oversized image.
    pub fn load_images<'s>(
        &mut self,
        statements: impl Iterator<Item = (&'s str, &'s TextureStatement)>,
    ) -> ImportResult<()> {
        let mut waiting = ImageDecodeQueue::default();
        let mut errors = Vec::new();
        let (mut requested, mut accepted) = (HashSet::new(), HashSet::new());
        for (library, statement) in statements {
            let key = (library.to_owned(), statement.path.clone());
            if !requested.insert(key.clone()) {
                continue;
            }
            match self.read_image(library, &key.1, &accepted)? {
                Ok((path, bytes)) => {
                    self.textures.images.insert(key, path.clone());
                    if accepted.insert(path.clone()) {
                        let images = &mut self.scene.images;
                        waiting.add_image(images.len(), format!("`{path}`"), bytes.into());
                        images.push(Image {
                            name: path.clone(),
                            path,
                            data: None,
                            mended: 0,
                        });
                    }
                }
                Err(reason) => errors.push(reason),
            }
        }
        let report = waiting.decode_images(&mut self.scene.images, self.limits, &|| {})?;
        for reason in errors.into_iter().chain(report.errors) {
            warn!(
                self.warnings,
                Picture, "texture: {reason}; the texture is left out"
            );
        }
        for (code, remark) in report.remarks {
            self.warnings.add(code, format!("texture: {remark}"));
        }
        self.scene.images.retain(|image| image.data.is_some());
        let images = self.scene.images.iter();
        let decoded: HashSet<&str> = images.map(|image| &*image.path).collect();
        self.textures
            .images
            .retain(|_, path| decoded.contains(&**path));
        Ok(())
    }

    /// Reads the first image that exists among the candidates for a path. Returns the path of this
    /// image and its bytes, which are empty for an image that is `accepted` already; or the reason
    /// why the first candidate cannot be read.
    fn read_image(
        &mut self,
        library: &str,
        path: &str,
        accepted: &HashSet<String>,
    ) -> ImportResult<Result<(String, Vec<u8>), String>> {
        let mut failure = None;
        for path in image_candidates(library, path) {
            if accepted.contains(&path) {
                return Ok(Ok((path, Vec::new())));
            }
            let read = self.folder.read(&path).map_err(Fault::from);
            let read = read.and_then(|bytes| {
                image_file::reserve_picture_memory(&bytes, self.limits, &mut self.budget)
                    .with_place(format_args!("`{path}`"))?;
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
        map: &TextureStatement,
        space: ColourSpace,
    ) -> Option<TextureRef> {
        let uv_transform = map.uv_transform();
        let TextureNames {
            images,
            textures,
            names,
        } = &mut self.textures;
        let image = images.get(&(library.to_owned(), map.path.clone()))?;
        let wrap = match map.clamp {
            true => WrapMode::Clamp,
            false => WrapMode::Repeat,
        };
        let key = (image.clone(), space == ColourSpace::Srgb, map.clamp);
        let name = textures.entry(key).or_insert_with(|| {
            let name = names.make_unique(image);
            self.scene.textures.push(Texture {
                name: name.clone(),
                image: image.clone(),
                colour_space: space,
                filter: TextureFilter::Bilinear,
                wrap_u: wrap,
                wrap_v: wrap,
            });
            name
        });
        Some(TextureRef {
            name: name.clone(),
            uv_set: 0,
            uv: None,
            uv_transform,
            factor: Colour::WHITE,
            // Colours have all channels.
            channel: map.channel.filter(|_| space == ColourSpace::Linear),
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
        let channel = |text: &str| TextureStatement::parse(text).channel;
        assert_eq!(channel("-imfchan b a.png"), Some(Channel::Blue));
        assert_eq!(channel("-imfchan m a.png"), Some(Channel::Alpha));
        assert_eq!(channel("a.png"), None);
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
