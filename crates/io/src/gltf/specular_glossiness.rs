//! KHR_materials_pbrSpecularGlossiness in terms of metallic-roughness: its factors, and its images texel by texel.

use std::collections::{BTreeMap, HashMap};

use rayon::prelude::*;
use raywright_core::display::curve::{decode, encode};
use raywright_core::scene::{Colour, ColourSpace, Image, ImageData, Physical, Pixels, Scene, Texture, TextureRef, TransferCurve};

use super::Import;
use super::entries::SpecularGlossiness;
use super::texture::Use;
use crate::import::{Budget, Outcome};

/// Reflectance at normal incidence of the dielectrics of the metallic-roughness model (index of refraction 1.5).
const DIELECTRIC: f64 = 0.04;

/// What a material says besides its images: diffuse colour, specular colour, glossiness.
#[derive(Clone, Copy, Debug)]
struct Factors {
    diffuse: [f64; 3],
    specular: [f64; 3],
    glossiness: f64,
}

impl Factors {
    fn of(source: &SpecularGlossiness) -> Self {
        let unit = |value: f32| unit(f64::from(value));
        let [r, g, b, _] = source.diffuse_factor;
        Self {
            diffuse: [r, g, b].map(unit),
            specular: source.specular_factor.map(unit),
            glossiness: unit(source.glossiness_factor),
        }
    }

    fn bits(&self) -> [u64; 7] {
        let ([r, g, b], [x, y, z]) = (self.diffuse, self.specular);
        [r, g, b, x, y, z, self.glossiness].map(f64::to_bits)
    }
}

/// Base colour and metalness so that diffuse and mirrored light come out alike.
///
/// With base colour c and metalness m, metallic-roughness has a diffuse albedo of c·(1−m)·(1−0.04) and a reflectance of
/// 0.04·(1−m) + c·m. Set equal to diffuse·(1−max specular) and specular of the given material, taken by their means, these
/// give a quadratic in m; c follows for each channel from whichever part m favours.
fn converted(diffuse: [f64; 3], specular: [f64; 3]) -> ([f64; 3], f64) {
    let strongest = specular.into_iter().fold(0.0, f64::max);
    let diffuse = diffuse.map(|c| c * (1.0 - strongest) / (1.0 - DIELECTRIC));
    let metallic = metalness(mean(diffuse), mean(specular));
    let channel = |i: usize| {
        let from_diffuse = diffuse[i] / (1.0 - metallic).max(1e-4);
        let from_specular = (specular[i] - DIELECTRIC * (1.0 - metallic)) / metallic.max(1e-4);
        let share = metallic * metallic;
        unit(from_diffuse * (1.0 - share) + from_specular * share)
    };
    ([channel(0), channel(1), channel(2)], metallic)
}

/// The m of c·(1−m) = d and 0.04·(1−m) + c·m = s: with c taken from the first, 0.04·m² + (d + s − 0.08)·m + 0.04 − s = 0.
fn metalness(d: f64, s: f64) -> f64 {
    if s <= DIELECTRIC {
        return 0.0;
    }
    let (a, b, c) = (DIELECTRIC, d + s - 2.0 * DIELECTRIC, DIELECTRIC - s);
    unit((-b + (b * b - 4.0 * a * c).max(0.0).sqrt()) / (2.0 * a))
}

fn mean(v: [f64; 3]) -> f64 {
    (v[0] + v[1] + v[2]) / 3.0
}

fn unit(value: f64) -> f64 {
    if value.is_nan() { 0.0 } else { value.clamp(0.0, 1.0) }
}

impl Import<'_> {
    /// Sets what a material of the old model says in place of base colour, metalness, roughness and opacity.
    pub(super) fn specular_glossiness(&mut self, source: &SpecularGlossiness, label: &str, out: &mut Physical) -> Outcome<()> {
        let factors = Factors::of(source);
        let (base, metallic) = converted(factors.diffuse, factors.specular);
        (out.base_colour, out.metallic) = (Colour(base).into(), metallic.into());
        out.roughness = (1.0 - factors.glossiness).into();
        out.opacity = unit(source.diffuse_factor[3].into()).into();
        out.base_colour_texture = self.texture(source.diffuse_texture.as_ref(), Use::Colour)?;
        out.metallic_roughness_texture = None;
        let Some(glossy) = self.texture(source.specular_glossiness_texture.as_ref(), Use::Colour)? else { return Ok(()) };
        let place = |texture: &TextureRef| (texture.uv_set, texture.uv_transform);
        if out.base_colour_texture.as_ref().is_some_and(|diffuse| place(diffuse) != place(&glossy)) {
            self.warnings.add(format!(
                "{label}: its diffuse and its specular image lie differently on the surface; the specular one's factors alone count"
            ));
            return Ok(());
        }
        let diffuse = out.base_colour_texture.as_ref().map(|diffuse| diffuse.name.clone());
        let names = self.baked(Recipe { diffuse, glossy: glossy.name.clone(), factors });
        let [base, data] = names.map(|name| Some(TextureRef { name, ..glossy.clone() }));
        (out.base_colour, out.metallic, out.roughness) = (Colour::WHITE.into(), 1.0.into(), 1.0.into());
        (out.base_colour_texture, out.metallic_roughness_texture) = (base, data);
        Ok(())
    }

    /// Names of the textures that will be made by a recipe, each made once.
    fn baked(&mut self, recipe: Recipe) -> [String; 2] {
        let key = (recipe.diffuse.clone(), recipe.glossy.clone(), recipe.factors.bits());
        if let Some(known) = self.bakery.known.get(&key) {
            return known.clone();
        }
        let first = self.scene.images.len();
        let names = [("base colour", ColourSpace::Srgb), ("metallic-roughness", ColourSpace::Linear)].map(|(what, space)| {
            let wish = format!("{} as {what}", recipe.glossy);
            let (name, image) = (self.names.textures.unique(&wish), self.names.images.unique(&wish));
            // Filter and wrapping are those of the texture that it is made of, which is looked up when all are known.
            let texture = Texture {
                name: name.clone(),
                image: image.clone(),
                colour_space: space,
                filter: raywright_core::scene::Filter::default(),
                wrap_u: raywright_core::scene::Wrap::default(),
                wrap_v: raywright_core::scene::Wrap::default(),
            };
            self.scene.textures.push(texture);
            self.scene.images.push(Image { name: image.clone(), path: image, data: None });
            name
        });
        self.bakery.recipes.push((recipe, first, self.scene.textures.len() - 2));
        self.bakery.known.insert(key, names.clone());
        names
    }
}

/// What two images are made of: names of textures.
#[derive(Clone, Debug)]
struct Recipe {
    diffuse: Option<String>,
    glossy: String,
    factors: Factors,
}

/// Images of metallic-roughness that wait for those that they are made of.
#[derive(Debug, Default)]
pub(super) struct Bakery {
    /// With the place of the first of its two images and of its two textures.
    recipes: Vec<(Recipe, usize, usize)>,
    known: BTreeMap<(Option<String>, String, [u64; 7]), [String; 2]>,
}

impl Bakery {
    /// Makes the images, once those that they are made of are decoded.
    ///
    /// # Errors
    /// A fault of kind limit where they take more memory than is left.
    pub fn bake(self, scene: &mut Scene, budget: &mut Budget) -> Outcome<()> {
        if self.recipes.is_empty() {
            return Ok(());
        }
        let textures: HashMap<String, usize> = scene.textures.iter().enumerate().map(|(i, t)| (t.name.clone(), i)).collect();
        let images: HashMap<String, usize> = scene.images.iter().enumerate().map(|(i, image)| (image.name.clone(), i)).collect();
        for (recipe, image, texture) in self.recipes {
            let own = |name: &str| textures.get(name).map(|&i| &scene.textures[i]);
            let pixels = |name: &str| scene.images[*images.get(&own(name)?.image)?].data.clone();
            let Some(like) = own(&recipe.glossy).cloned() else { continue };
            // One that can't be decoded leaves its factors.
            let white = || ImageData { width: 1, height: 1, pixels: Pixels::Codes(vec![[255; 4]]) };
            let glossy = pixels(&recipe.glossy).unwrap_or_else(|| white().into());
            let diffuse = recipe.diffuse.as_deref().and_then(pixels);
            let size = larger(&glossy, diffuse.as_deref());
            budget.memory(size[0] as usize * size[1] as usize, 2 * size_of::<[u8; 4]>())?;
            let made = bake(size, diffuse.as_deref(), &glossy, &recipe.factors);
            for (i, data) in made.into_iter().enumerate() {
                scene.images[image + i].data = Some(data.into());
                let texture = &mut scene.textures[texture + i];
                (texture.filter, texture.wrap_u, texture.wrap_v) = (like.filter, like.wrap_u, like.wrap_v);
            }
        }
        Ok(())
    }
}

fn larger(one: &ImageData, other: Option<&ImageData>) -> [u32; 2] {
    let [width, height] = other.map_or([0; 2], |other| [other.width, other.height]);
    [one.width.max(width), one.height.max(height)]
}

/// Base colour with opacity, and metallic-roughness, in 8-bit codes. Of images that differ in size the smaller one's texels are
/// repeated.
fn bake(size: [u32; 2], diffuse: Option<&ImageData>, glossy: &ImageData, factors: &Factors) -> [ImageData; 2] {
    let curve: Vec<f64> = (0..256).map(|code| decode(TransferCurve::Srgb, f64::from(code) / 255.0)).collect();
    let texel = |image: &ImageData, x: u32, y: u32| {
        let scaled = |at: u32, to: u32, from: u32| (u64::from(at) * u64::from(from) / u64::from(to)) as usize;
        let at = scaled(y, size[1], image.height) * image.width as usize + scaled(x, size[0], image.width);
        match &image.pixels {
            Pixels::Linear(pixels) => pixels[at].map(f64::from),
            Pixels::Codes(pixels) => {
                let [r, g, b, a] = pixels[at].map(usize::from);
                [curve[r], curve[g], curve[b], a as f64 / 255.0]
            }
        }
    };
    let code = |share: f64| (unit(share) * 255.0).round() as u8;
    let one = |x: u32, y: u32| {
        let [r, g, b, glossiness] = texel(glossy, x, y);
        let [dr, dg, db, opacity] = diffuse.map_or([1.0; 4], |diffuse| texel(diffuse, x, y));
        let [d, s] = [([dr, dg, db], factors.diffuse), ([r, g, b], factors.specular)]
            .map(|(image, factor)| core::array::from_fn::<f64, 3, _>(|i| unit(image[i] * factor[i])));
        let (base, metallic) = converted(d, s);
        let [r, g, b] = base.map(|c| code(encode(TransferCurve::Srgb, c)));
        ([r, g, b, code(opacity)], [0, code(1.0 - glossiness * factors.glossiness), code(metallic), 255])
    };
    let rows = (0..size[1]).into_par_iter().flat_map_iter(|y| (0..size[0]).map(move |x| (x, y)));
    let (base, data): (Vec<[u8; 4]>, Vec<[u8; 4]>) = rows.map(|(x, y)| one(x, y)).unzip();
    [base, data].map(|pixels| ImageData { width: size[0], height: size[1], pixels: Pixels::Codes(pixels) })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Protects: the two ends that have an exact counterpart: a plain dielectric and a pure metal.
    #[test]
    fn dielectrics_and_metals_convert_exactly() {
        let (base, metallic) = converted([0.5, 0.25, 0.125], [0.04; 3]);
        assert_eq!(metallic, 0.0);
        assert!(base.iter().zip([0.5, 0.25, 0.125]).all(|(a, b)| (a - b).abs() < 1e-6), "{base:?}");
        let (base, metallic) = converted([0.0; 3], [1.0, 0.75, 0.5]);
        assert!((metallic - 1.0).abs() < 1e-9, "{metallic}");
        assert!(base.iter().zip([1.0, 0.75, 0.5]).all(|(a, b)| (a - b).abs() < 1e-6), "{base:?}");
    }

    /// Protects: what is between a dielectric and a metal, by hand. Of diffuse (0.8, 0.2, 0.2) specular 0.3 leaves 0.7, which over 0.96 is
    /// d = (0.5833, 0.1458, 0.1458), 0.2917 in the mean. Then 0.04·m² + 0.5117·m − 0.26 = 0, of which m = 0.4894. A channel is d/(1 − m),
    /// (1.1425, 0.2856, 0.2856), mixed by m² = 0.2395 with (0.3 − 0.04·(1 − m))/m = 0.5712: 1, clipped, and 0.3540.
    #[test]
    fn between_dielectric_and_metal() {
        let (base, metallic) = converted([0.8, 0.2, 0.2], [0.3; 3]);
        assert!((metallic - 0.489_418).abs() < 1e-6, "{metallic}");
        assert!(base.iter().zip([1.0, 0.354_037, 0.354_037]).all(|(a, b)| (a - b).abs() < 1e-6), "{base:?}");
    }

    /// Protects: each texel of the made images is what factors of its colours would give, to half a code; opacity is the diffuse
    /// image's, roughness what glossiness leaves, and an image of another size lies over the same surface.
    #[test]
    fn images_are_converted_texel_by_texel() {
        let srgb = |code: u8| decode(TransferCurve::Srgb, f64::from(code) / 255.0);
        let colours = [[200, 30, 90, 255], [0, 0, 0, 0], [255, 255, 255, 77], [12, 240, 3, 128]];
        let codes = |width, height, pixels: &[[u8; 4]]| ImageData { width, height, pixels: Pixels::Codes(pixels.to_vec()) };
        let glossy = codes(2, 2, &colours);
        let diffuse = codes(4, 1, &[[255, 128, 0, 10], [0, 60, 250, 20], [77, 77, 77, 30], [1, 2, 3, 40]]);
        let factors = Factors { diffuse: [1.0, 0.5, 0.25], specular: [0.5, 1.0, 0.75], glossiness: 0.8 };
        let size = larger(&glossy, Some(&diffuse));
        assert_eq!(size, [4, 2]);
        let [base, data] = bake(size, Some(&diffuse), &glossy, &factors);
        let (Pixels::Codes(base), Pixels::Codes(data), Pixels::Codes(below)) = (&base.pixels, &data.pixels, &diffuse.pixels)
        else {
            panic!("codes")
        };
        for (i, (base, data)) in base.iter().zip(data).enumerate() {
            let (x, y) = (i % 4, i / 4);
            let [r, g, b, gloss] = colours[y * 2 + x / 2];
            let [dr, dg, db, opacity] = below[x];
            let d = [srgb(dr), srgb(dg) * 0.5, srgb(db) * 0.25];
            let (colour, metallic) = converted(d, [srgb(r) * 0.5, srgb(g), srgb(b) * 0.75]);
            for (code, expected) in base.iter().zip(colour) {
                let [least, most] =
                    [-0.51, 0.51].map(|half| decode(TransferCurve::Srgb, unit((f64::from(*code) + half) / 255.0)));
                assert!((least..=most).contains(&expected), "{i}: {base:?}, not {colour:?}");
            }
            let expected = [1.0 - f64::from(gloss) / 255.0 * 0.8, metallic].map(|share| share * 255.0);
            assert!((f64::from(data[1]) - expected[0]).abs() <= 0.5 && (f64::from(data[2]) - expected[1]).abs() <= 0.5);
            assert_eq!(base[3], opacity);
        }
    }
}
