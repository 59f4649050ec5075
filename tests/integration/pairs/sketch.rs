//! A scene of the net while values of the axes are applied to it.

use std::io::{Cursor, Error, ErrorKind};

use image::{ImageFormat, Rgb, RgbImage};
use raywright::core::Settings;
use raywright::core::scene::Scene;
use raywright::io::{Input, LoadOptions, Resolver, load};
use serde_json::{Value, json};

/// The body's constant colour.
pub const COLOUR: [f64; 3] = [0.7, 0.5, 0.3];

/// How the colour of the body's material is given.
#[derive(Clone, Debug, PartialEq)]
pub enum Colouring {
    /// By a constant, an expression or a checkerboard.
    Input(Value),
    /// By a picture: keys of the texture, and keys of its use.
    Texture(Value, Value),
    /// By a white picture, whose factor is the colour.
    EvenTexture(Value, Value),
    /// By the mesh.
    Vertices,
}

/// The parts of a scene, as JSON, and of its settings.
pub struct Sketch {
    /// Keys of the scene.
    pub parts: Value,
    /// Keys of the body's object, without its places.
    pub body: Value,
    /// Keys of the body's material.
    pub model: Value,
    /// Family of the body's material.
    family: &'static str,
    /// Form of its colour.
    pub colouring: Colouring,
    /// Keys of the camera.
    pub camera: Value,
    /// Places of the body's copies.
    pub copies: Vec<[f64; 3]>,
    /// Rule that places the copies instead.
    pub generator: Option<Value>,
    /// Steps of the body's transform.
    pub steps: Vec<Value>,
    /// Further steps of the body's transform at the end of its motion; empty: it stands still.
    pub end: Vec<Value>,
    /// Options of the loader.
    pub options: LoadOptions,
    changes: Vec<fn(&mut Settings)>,
}

impl Sketch {
    /// The scene before any value is applied.
    pub fn new() -> Self {
        let list = || json!([]);
        Self {
            parts: json!({ "format": 1, "materials": list(), "meshes": list(), "objects": list(), "lights": list(), "images": list(), "textures": list() }),
            body: json!({ "material": "body" }),
            model: json!({}),
            family: "physical",
            colouring: Colouring::Input(json!(COLOUR)),
            camera: json!({ "pose": { "look_at": { "eye": [0.3, 1, 4], "target": [0, 0, 0] } }, "projection": { "pinhole": { "vertical_fov": 40 } } }),
            copies: vec![[0.0; 3]],
            generator: None,
            steps: Vec::new(),
            end: Vec::new(),
            options: LoadOptions::default(),
            changes: Vec::new(),
        }
    }

    /// Appends an entry to a list of the scene.
    pub fn add(&mut self, list: &str, entry: Value) {
        self.parts[list].as_array_mut().expect("a list").push(entry);
    }

    /// Sets the body's shape.
    pub fn shape(&mut self, shape: Value) {
        self.body["shape"] = shape;
    }

    /// Makes the body a closed mesh; a smooth one has normals, coordinates and colours.
    pub fn mesh(&mut self, smooth: bool) {
        let mut data = json!({
            "positions": [[-0.8, -0.6, -0.7], [0.8, -0.7, -0.6], [0, -0.6, 0.9], [0.1, 0.9, 0]],
            "indices": [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]],
            "colours": [[1, 0.2, 0.1, 1], [0.2, 1, 0.3, 1], [0.1, 0.3, 1, 0.6], [0.9, 0.9, 0.2, 1]],
        });
        if smooth {
            data["normals"] = json!([
                [-0.8, -0.5, -0.7],
                [0.8, -0.5, -0.6],
                [0, -0.5, 0.9],
                [0, 1, 0]
            ]);
            data["uvs"] = json!([[[0, 0], [1, 0.1], [0.9, 1], [0.2, 0.8]]]);
        }
        self.add(
            "meshes",
            json!({ "name": "body", "source": { "inline": data } }),
        );
        self.shape(json!({ "mesh": "body" }));
    }

    /// Appends a step to the body's transform.
    pub fn step(&mut self, step: Value) {
        self.steps.push(step);
    }

    /// Makes the body's material a classic one.
    pub fn classic(&mut self, terms: Value) {
        self.family = "classic";
        self.fields(terms);
    }

    /// Makes the body's material a physical one.
    pub fn physical(&mut self, fields: Value) {
        self.family = "physical";
        self.fields(fields);
    }

    /// Adds fields to the body's material.
    pub fn fields(&mut self, fields: Value) {
        for (key, value) in fields.as_object().expect("fields") {
            self.model[key] = value.clone();
        }
    }

    /// Adds a picture by the name of its file without the ending.
    pub fn image(&mut self, name: &str) {
        let images = self.parts["images"].as_array().expect("a list");
        if images.iter().all(|own| own["name"] != name) {
            let path = format!("{name}.png");
            self.add("images", json!({ "name": name, "path": path }));
        }
    }

    /// Adds a texture of a picture, and returns its use.
    pub fn texture(&mut self, image: &str, mut texture: Value, mut own: Value) -> Value {
        let number = self.parts["textures"].as_array().expect("a list").len();
        let name = format!("{image} {number}");
        self.image(image);
        (texture["name"], texture["image"]) = (json!(name), json!(image));
        self.add("textures", texture);
        own["name"] = json!(name);
        own
    }

    /// Adds a floor under a transform.
    pub fn floor(&mut self, shape: Value, transform: Value) {
        self.add("materials", json!({ "name": "floor", "model": { "physical": { "base_colour": 0.6, "roughness": 0.7 } } }));
        self.add(
            "objects",
            json!({ "name": "floor", "shape": shape, "material": "floor", "transform": transform }),
        );
    }

    /// Adds a light without size.
    pub fn light(&mut self, kind: Value, strength: f64) {
        self.add(
            "lights",
            json!({ "kind": kind, "colour": [strength, 0.9 * strength, 0.7 * strength] }),
        );
    }

    /// Adds a lamp.
    pub fn lamp(&mut self, shape: Value, strength: f64) {
        let name = format!("lamp {strength}");
        let lamps = self.parts["materials"].as_array().expect("a list");
        if lamps.iter().all(|own| own["name"] != name.as_str()) {
            self.add(
                "materials",
                json!({ "name": name, "model": { "physical": { "emission": strength } } }),
            );
        }
        self.add("objects", json!({ "shape": shape, "material": name }));
    }

    /// Adds a change of the settings.
    pub fn settings(&mut self, change: fn(&mut Settings)) {
        self.changes.push(change);
    }

    /// Adds the body's material.
    fn add_material(&mut self) {
        let (colour, texture) = match self.family {
            "classic" => ("colour", None),
            _ => ("base_colour", Some("base_colour_texture")),
        };
        let mut model = self.model.take();
        let picture = match self.colouring.clone() {
            Colouring::Input(input) => {
                model[colour] = input;
                None
            }
            Colouring::Vertices => {
                model["vertex_colours"] = json!(true);
                None
            }
            Colouring::Texture(keys, own) => Some(self.texture("spots", keys, own)),
            Colouring::EvenTexture(keys, own) => Some(self.texture("even", keys, own)),
        };
        match (picture, texture) {
            (Some(picture), Some(key)) => model[key] = picture,
            (Some(picture), None) => model[colour] = json!({ "texture": picture }),
            _ => {}
        }
        self.add(
            "materials",
            json!({ "name": "body", "model": { self.family: model } }),
        );
    }

    /// Places the body's copies, smaller ones where there are several.
    fn add_body(&mut self) {
        let size = match (&self.generator, self.copies.len()) {
            (None, 0..=2) => None,
            (None, _) => Some(0.5),
            (Some(kind), _) => Some(if kind.get("grid").is_some() { 0.4 } else { 0.2 }),
        };
        let scale = size.map(|size| json!({ "scale": [size, size, size] }));
        let own: Vec<Value> = scale.into_iter().chain(self.steps.clone()).collect();
        let at = |place: [f64; 3]| {
            let there = (place != [0.0; 3]).then(|| json!({ "translate": place }));
            let mut object = self.body.clone();
            object["transform"] = own.iter().cloned().chain(there.clone()).collect();
            if !self.end.is_empty() {
                object["transform_end"] =
                    own.iter().chain(&self.end).cloned().chain(there).collect();
            }
            object
        };
        match self.generator.clone() {
            Some(kind) => {
                self.parts["generators"] = json!([{ "kind": kind, "object": at([0.0; 3]) }])
            }
            None => self
                .copies
                .iter()
                .map(|&place| at(place))
                .collect::<Vec<_>>()
                .into_iter()
                .for_each(|object| self.add("objects", object)),
        }
    }

    /// Completes and loads the scene.
    pub fn finish(mut self) -> Result<(Scene, Settings), String> {
        self.add_material();
        self.add_body();
        self.parts["cameras"] = json!([self.camera]);
        let input = Input::Bytes {
            name: "pairs.scene.json".to_owned(),
            bytes: self.parts.to_string().into(),
            resolver: Some(Resolver::new(read_picture_file)),
        };
        let loaded = load(&input, &self.options).map_err(|e| e.to_string())?;
        let mut settings = Settings::from_scene(&loaded.scene);
        (settings.size, settings.tile_size) = ([12, 9], 5);
        self.changes.iter().for_each(|change| change(&mut settings));
        Ok((loaded.scene, settings))
    }
}

/// The pictures that scenes name, as PNG files.
fn read_picture_file(path: &str) -> Result<Vec<u8>, Error> {
    let pixel: fn(u32, u32) -> [u8; 3] = match path {
        "even.png" => |_, _| [255; 3],
        "spots.png" => |x, y| {
            [
                (40 + 60 * ((x + y) % 4)) as u8,
                (30 * x + 20) as u8,
                (25 * y + 30) as u8,
            ]
        },
        "bumps.png" => |x, y| [(108 + 40 * (x % 2)) as u8, (148 - 40 * (y % 2)) as u8, 240],
        "sky.png" => |x, y| {
            if (x, y) == (5, 2) {
                [255; 3]
            } else {
                [(10 * x) as u8, (20 * y) as u8, 60]
            }
        },
        _ => return Err(ErrorKind::NotFound.into()),
    };
    let mut bytes = Cursor::new(Vec::new());
    RgbImage::from_fn(8, 8, |x, y| Rgb(pixel(x, y)))
        .write_to(&mut bytes, ImageFormat::Png)
        .map_err(Error::other)?;
    Ok(bytes.into_inner())
}
