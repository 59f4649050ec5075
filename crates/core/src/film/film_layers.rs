//! Layers of a film, by the source of their values.

use serde::{Deserialize, Serialize};

use crate::settings::Aov;

/// Layers of a film by the source of their values, with their channel names in files.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "Vec<Aov>", into = "Vec<Aov>")]
pub(crate) struct FilmLayers {
    pub(super) asked: Vec<Aov>,
    /// Means over the first hits of all samples.
    pub mean: Vec<(Aov, [&'static str; 3])>,
    /// Values at the first hit of the pixel-centre ray, or of a grid of such rays.
    pub centre: Vec<(Aov, &'static str)>,
    /// Whether the film has the layer of sample counts, computed from the pixel's sums.
    pub samples: bool,
    /// Whether the film has the layer of standard errors, computed from the pixel's sums.
    pub standard_error: bool,
}

impl From<FilmLayers> for Vec<Aov> {
    fn from(layers: FilmLayers) -> Self {
        layers.asked
    }
}

impl From<Vec<Aov>> for FilmLayers {
    fn from(requested: Vec<Aov>) -> Self {
        let mut mean = Vec::new();
        let mut centre = Vec::new();
        for &aov in &requested {
            match aov {
                Aov::Albedo => mean.push((aov, ["albedo.R", "albedo.G", "albedo.B"])),
                Aov::Normal => mean.push((aov, ["normal.X", "normal.Y", "normal.Z"])),
                Aov::Position => mean.push((aov, ["position.X", "position.Y", "position.Z"])),
                Aov::Emission => mean.push((aov, ["emission.R", "emission.G", "emission.B"])),
                Aov::Depth => centre.push((aov, "depth.Z")),
                Aov::Object => centre.push((aov, "object.id")),
                Aov::Material => centre.push((aov, "material.id")),
                Aov::Edges => centre.push((aov, "edges.V")),
                Aov::Samples | Aov::StandardError => {}
            }
        }
        let has = |aov| requested.contains(&aov);
        Self {
            mean,
            centre,
            samples: has(Aov::Samples),
            standard_error: has(Aov::StandardError),
            asked: requested,
        }
    }
}
