//! A mesh in use, as the checks of triangles, edges and texture coordinates examine it.

use super::cameras::CameraView;
use super::facts::{ObjectFacts, SceneFacts};
use super::ray_survey::RaySurvey;
use crate::scene::MeshData;

/// A mesh with the objects that show it.
pub(super) struct UsedMesh<'a> {
    pub scene_facts: &'a SceneFacts<'a>,
    pub data: &'a MeshData,
    pub objects: Vec<&'a ObjectFacts<'a>>,
    pub survey: &'a RaySurvey,
    pub views: &'a [CameraView],
    /// Whether no triangle of the whole scene has an area.
    pub scene_has_no_area: bool,
}
