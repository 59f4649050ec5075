//! Random scenes of every shape, material and light, at any position, scale and orientation of
//! axes. Positions are multiples of a 1024th of the scene's unit, so that multiplication by powers
//! of two and addition of whole units are exact.

use glam::DVec3;
use raywright::bvh::stability::verdicts::CaseRng;
use raywright::core::Scene;
use serde_json::{Value, json};

/// Position, scale and axes of a scene.
#[derive(Clone, Copy, Debug)]
pub struct WorldLayout {
    /// Length of its unit in metres.
    pub unit: f64,
    /// Position of its origin in metres.
    pub offset: DVec3,
    /// Scene axis along each world axis.
    pub axes: [usize; 3],
    /// Sign of each world axis.
    pub signs: DVec3,
}

impl Default for WorldLayout {
    fn default() -> Self {
        Self {
            unit: 1.0,
            offset: DVec3::ZERO,
            axes: [0, 1, 2],
            signs: DVec3::ONE,
        }
    }
}

impl WorldLayout {
    /// Maps a direction.
    fn turned(&self, v: DVec3) -> DVec3 {
        self.signs * DVec3::from(self.axes.map(|axis| v[axis]))
    }
    fn direction(&self, v: DVec3) -> [f64; 3] {
        self.turned(v).into()
    }
    /// Maps a difference of positions.
    fn vector(&self, v: DVec3) -> [f64; 3] {
        (self.turned(v) * self.unit).into()
    }
    /// Maps lengths along the axes.
    fn lengths(&self, v: DVec3) -> [f64; 3] {
        (self.turned(v) * self.signs * self.unit).into()
    }
    /// Maps a position.
    fn point(&self, p: DVec3) -> [f64; 3] {
        (self.turned(p) * self.unit + self.offset).into()
    }
    /// Orders two corners or edges so that a face keeps its outside, which a reflected layout would
    /// reverse.
    fn as_wound<T>(&self, [a, b]: [T; 2]) -> [T; 2] {
        if self.signs.element_product() < 0.0 {
            [b, a]
        } else {
            [a, b]
        }
    }
    /// Maps a linear transform, given by three rows, about a position, with the translation to that
    /// position.
    fn map(&self, linear: [DVec3; 3], place: DVec3) -> Value {
        let at = self.point(place);
        let row = |i: usize| {
            let own = linear[self.axes[i]];
            let turned = self.turned(own) * self.signs[i];
            [turned.x, turned.y, turned.z, at[i]]
        };
        json!([{ "matrix": [row(0), row(1), row(2)] }])
    }
    /// The same layout without its offset, for shapes that a transform moves there.
    fn local(&self) -> Self {
        Self {
            offset: DVec3::ZERO,
            ..*self
        }
    }
}

/// Kinds of items in a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WorldContents {
    /// All kinds.
    All,
    /// Only items without a vertical direction: no shape about y, no gradient, no pattern of
    /// positions.
    Turnable,
}

/// Generates the numbers of a scene from its seed.
struct WorldMaker<'a> {
    rng: CaseRng,
    layout: &'a WorldLayout,
    contents: WorldContents,
}

impl WorldMaker<'_> {
    /// A number in a range, a multiple of a 1024th.
    fn step(&mut self, low: f64, high: f64) -> f64 {
        (self.rng.next_uniform(low, high) * 1024.0).round() / 1024.0
    }
    fn place(&mut self, reach: f64) -> DVec3 {
        DVec3::new(
            self.step(-reach, reach),
            self.step(0.125, 2.5),
            self.step(-reach, reach),
        )
    }
    fn vector(&mut self, reach: f64) -> DVec3 {
        DVec3::new(
            self.step(-reach, reach),
            self.step(-reach, reach),
            self.step(-reach, reach),
        )
    }
    /// A vector that is neither short nor along an axis.
    fn axis(&mut self) -> DVec3 {
        self.vector(0.5) + DVec3::new(0.75, 1.0, 0.625)
    }
    fn colour(&mut self) -> [f64; 3] {
        [(); 3].map(|()| self.rng.next_uniform(0.1, 0.9))
    }
    fn chance(&mut self, of: f64) -> bool {
        self.rng.next_in_unit_interval() < of
    }

    /// A shape of a kind at a position.
    fn shape(&mut self, kind: usize, place: DVec3, layout: &WorldLayout) -> Value {
        let (size, axis) = (self.step(0.25, 0.75), self.axis());
        let (length, at) = (layout.unit * size, layout.point(place));
        let metres = |share: f64| length * share;
        match kind {
            0 => json!({ "sphere": { "centre": at, "radius": length } }),
            1 => {
                json!({ "disk": { "centre": at, "normal": layout.direction(axis), "radius": length } })
            }
            2 => {
                let u = self.axis() * size;
                let [u, v] = layout.as_wound([u, self.vector(0.5) * size - u * 0.5]);
                json!({ "quad": { "corner": at, "edge_u": layout.vector(u), "edge_v": layout.vector(v) } })
            }
            3 => {
                let half = DVec3::new(
                    self.step(0.125, 0.5),
                    self.step(0.125, 0.5),
                    self.step(0.125, 0.5),
                );
                let corners = [-half, half].map(|corner| DVec3::from(layout.point(place + corner)));
                let [min, max] =
                    [corners[0].min(corners[1]), corners[0].max(corners[1])].map(|p| p.to_array());
                json!({ "box": { "min": min, "max": max } })
            }
            4 => {
                json!({ "cylinder": { "base": at, "axis": layout.direction(axis), "radius": metres(0.5), "height": metres(1.5), "caps": size > 0.4 } })
            }
            5 => {
                json!({ "cone": { "base": at, "axis": layout.direction(axis), "radius": metres(0.75), "top_radius": metres(0.25), "height": metres(1.5) } })
            }
            6 => {
                let semi = DVec3::new(
                    self.step(0.125, 0.75),
                    self.step(0.125, 0.75),
                    self.step(0.125, 0.75),
                );
                json!({ "ellipsoid": { "centre": at, "semi_axes": layout.lengths(semi) } })
            }
            7 => {
                json!({ "torus": { "centre": at, "axis": layout.direction(axis), "major_radius": metres(0.75), "minor_radius": metres(0.25) } })
            }
            8 => {
                let [b, c] = layout.as_wound([self.axis() * size, self.vector(0.75)]);
                json!({ "triangle": { "vertices": ([place, place + b, place + c].map(|p| layout.point(p))) } })
            }
            9 => {
                json!({ "hyperboloid": { "centre": at, "waist_radius": metres(0.5), "c": metres(0.75), "half_height": metres(1.0) } })
            }
            _ => json!({ "paraboloid": { "apex": at, "radius": length, "height": metres(1.25) } }),
        }
    }

    /// An object, untransformed or under a map that stretches, shears and may reflect.
    fn object(&mut self, materials: usize, meshes: &mut Vec<Value>) -> Value {
        let kinds = if self.contents == WorldContents::All {
            11
        } else {
            9
        };
        let (place, layout) = (self.place(3.5), *self.layout);
        let material = format!("m{}", self.rng.next_bits() as usize % materials);
        let is_mesh = self.chance(0.35);
        // The first mesh lies at zero and is shared by several transforms.
        let is_mapped = self.chance(0.4) || is_mesh && meshes.is_empty();
        let (from, there) = if is_mapped {
            (layout.local(), DVec3::ZERO)
        } else {
            (layout, place)
        };
        let shape = if is_mesh {
            let is_shared = !meshes.is_empty() && is_mapped && self.chance(0.6);
            let name = if is_shared {
                "mesh0".to_owned()
            } else {
                format!("mesh{}", meshes.len())
            };
            if !is_shared {
                meshes.push(self.mesh(&name, there, &from));
            }
            json!({ "mesh": name })
        } else {
            let kind = self.rng.next_bits() as usize % kinds;
            self.shape(kind, there, &from)
        };
        let transform = if is_mapped {
            let [a, b, c] = [(); 3].map(|()| self.vector(0.375));
            let mirror = if self.chance(0.3) { -1.0 } else { 1.0 };
            layout.map([a + DVec3::X * mirror, b + DVec3::Y, c + DVec3::Z], place)
        } else {
            json!([])
        };
        json!({ "shape": shape, "material": material, "transform": transform })
    }

    /// A closed irregular mesh of eighty faces, with or without vertex normals.
    fn mesh(&mut self, name: &str, place: DVec3, layout: &WorldLayout) -> Value {
        let mut ball: Vec<DVec3> = vec![];
        let mut index = |corner: DVec3| {
            let known = ball.iter().position(|&own| own == corner);
            known.unwrap_or_else(|| {
                ball.push(corner);
                ball.len() - 1
            })
        };
        let faces = raywright::bvh::stability::meshes::create_icosphere(1).into_iter();
        let faces: Vec<_> = faces.map(|face| face.map(&mut index)).collect();
        let size = self.step(0.375, 0.75);
        let bend = |p: DVec3| (p * size * 1024.0).round() / 1024.0;
        let corners: Vec<DVec3> = ball
            .iter()
            .map(|&p| bend(p) + self.vector(0.03) + place)
            .collect();
        let positions: Vec<[f64; 3]> = corners.iter().map(|&p| layout.point(p)).collect();
        let normals: Vec<[f64; 3]> = ball.iter().map(|&p| layout.direction(p)).collect();
        let face = |&[a, b, c]: &[usize; 3]| {
            let [b, c] = layout.as_wound([b, c]);
            [a, b, c]
        };
        let indices: Vec<_> = faces.iter().map(face).collect();
        let mut source = json!({ "positions": positions, "indices": indices });
        if self.chance(0.5) {
            source["normals"] = json!(normals);
        }
        json!({ "name": name, "source": { "inline": source } })
    }

    /// A material; classic ones use no random samples.
    fn material(&mut self, name: String, is_classic: bool) -> Value {
        let colour = self.colour();
        let kind = self.rng.next_bits() % 9;
        let unit = self.layout.unit;
        let model = match kind {
            _ if is_classic && kind < 2 => {
                json!({ "colour": colour, "diffuse": 0.8, "reflection": { "weight": 0.4 } })
            }
            _ if is_classic && kind == 2 => {
                json!({ "colour": colour, "diffuse": 0.2, "transmission": { "ior": 1.5 } })
            }
            3 if is_classic && self.contents == WorldContents::All => {
                json!({ "colour": { "checker": { "even": colour, "odd": [0.1, 0.2, 0.3], "size": 0.5 * unit } }, "diffuse": 1 })
            }
            _ if is_classic => {
                json!({ "colour": colour, "diffuse": 0.9, "specular": { "model": "blinn", "exponent": 20, "strength": 0.4 } })
            }
            0 => {
                json!({ "base_colour": [1, 1, 1], "roughness": 0, "transmission": 1, "attenuation_colour": colour, "attenuation_distance": 2.0 * unit })
            }
            1 => json!({ "base_colour": colour, "roughness": 0.3, "metallic": 1 }),
            2 => json!({ "base_colour": colour, "roughness": 0, "metallic": 1 }),
            3 => {
                json!({ "base_colour": colour, "roughness": 0.5, "clearcoat": { "factor": 1, "roughness": 0.1 } })
            }
            4 => {
                json!({ "base_colour": colour, "roughness": 0.4, "sheen": { "colour": [0.5, 0.5, 0.5], "roughness": 0.4 } })
            }
            5 => {
                json!({ "base_colour": colour, "roughness": 0.6, "thin_walled": true, "transmission": 0.5 })
            }
            6 => {
                json!({ "base_colour": colour, "roughness": 0.8, "diffuse_transmission": { "factor": 0.4 } })
            }
            7 => {
                json!({ "base_colour": colour, "roughness": 0.3, "alpha": "blend", "opacity": 0.6 })
            }
            _ => json!({ "base_colour": colour, "roughness": 0.9 }),
        };
        let family = if is_classic { "classic" } else { "physical" };
        json!({ "name": name, "model": { family: model } })
    }

    fn lights(&mut self) -> Value {
        let (layout, unit) = (*self.layout, self.layout.unit);
        let strength = |of: f64| [of * unit * unit; 3];
        let mut lights = vec![
            json!({ "kind": { "directional": { "to_light": layout.direction(self.axis()) } }, "colour": 0.6 }),
        ];
        if self.chance(0.7) {
            let place = self.place(4.0) + DVec3::Y * 4.0;
            lights.push(json!({ "kind": { "point": { "position": layout.point(place), "range": 40.0 * unit } }, "colour": strength(15.0) }));
        }
        if self.chance(0.5) {
            let (place, aside) = (self.place(2.0) + DVec3::Y * 5.0, self.vector(0.25));
            let spot = json!({ "position": layout.point(place), "direction": layout.direction(aside - DVec3::Y), "inner_angle": 10, "outer_angle": 50 });
            lights.push(json!({ "kind": { "spot": spot }, "colour": strength(25.0) }));
        }
        if self.chance(0.3) {
            let place = self.place(4.0) + DVec3::Y * 4.0;
            lights.push(json!({ "kind": { "point": { "position": layout.point(place), "falloff": "none" } }, "colour": 0.3 }));
        }
        json!(lights)
    }

    fn camera(&mut self) -> Value {
        let (layout, unit) = (*self.layout, self.layout.unit);
        let eye = self.vector(1.0) + DVec3::new(0.0, 3.0, 9.0);
        let target = self.vector(0.5) + DVec3::Y;
        let pose = json!({ "look_at": { "eye": layout.point(eye), "target": layout.point(target), "up": layout.direction(DVec3::Y) } });
        let pinhole = json!({ "vertical_fov": 42 });
        let kind = self.rng.next_bits() % 4;
        let projection = match kind {
            0 => json!({ "orthographic": { "height": 7.0 * unit } }),
            // Positions on a lens are sampled randomly.
            1 if self.contents == WorldContents::All => {
                json!({ "thin_lens": { "pinhole": pinhole, "aperture_radius": 0.125 * unit, "focus_distance": 8.0 * unit } })
            }
            _ => json!({ "pinhole": pinhole }),
        };
        json!({ "pose": pose, "projection": projection })
    }
}

/// The scene of a seed in a layout; equal scenes for all layouts.
pub fn world(seed: u64, contents: WorldContents, layout: &WorldLayout) -> Scene {
    let mut maker = WorldMaker {
        rng: CaseRng::new(seed, 1),
        layout,
        contents,
    };
    let is_classic = maker.chance(0.5);
    let materials: Vec<Value> = (0..5)
        .map(|i| maker.material(format!("m{i}"), is_classic))
        .collect();
    let mut meshes = Vec::new();
    let count = 8 + maker.rng.next_bits() as usize % 8;
    let mut objects: Vec<Value> = (0..count)
        .map(|_| maker.object(materials.len(), &mut meshes))
        .collect();
    objects.push(json!({ "shape": { "plane": { "point": layout.point(DVec3::ZERO), "normal": layout.direction(DVec3::Y) } }, "material": "ground" }));
    let ground = maker.colour();
    let ground = if is_classic {
        json!({ "classic": { "colour": ground, "diffuse": 0.9 } })
    } else {
        json!({ "physical": { "base_colour": ground } })
    };
    let mut materials = materials;
    materials.push(json!({ "name": "ground", "model": ground }));
    if !is_classic {
        let place = maker.place(2.0) + DVec3::Y * 3.5;
        let kind = maker.rng.choose(&[0, 1, 2, 3, 8]);
        objects.push(json!({ "shape": maker.shape(kind, place, layout), "material": "lamp" }));
        materials.push(json!({ "name": "lamp", "model": { "physical": { "base_colour": [0, 0, 0], "emission": [6, 5, 4] } } }));
    }
    let gradient = contents == WorldContents::All && maker.chance(0.5);
    let sky = if gradient {
        json!({ "gradient": { "bottom": [0.2, 0.2, 0.25], "top": [0.3, 0.4, 0.6] } })
    } else {
        json!({ "constant": [0.3, 0.35, 0.4] })
    };
    let render = if is_classic {
        json!({ "pattern": "centre", "integrator": "whitted" })
    } else {
        json!({ "samples": 2 })
    };
    let scene = json!({
        "format": 1, "render": render, "cameras": [maker.camera()], "lights": maker.lights(), "sky": sky,
        "materials": materials, "meshes": meshes, "objects": objects,
    });
    serde_json::from_value(scene).unwrap_or_else(|e| panic!("seed {seed}: {e}"))
}
