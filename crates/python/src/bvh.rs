//! Ray queries on arrays: closest hits, all hits and occlusion.

use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyTuple};
use rayon::prelude::*;
use raywright_bvh::{
    AcceleratorKind, Geometry, Hit, Interval, Occlusion, PrimitiveSet, Ray, Real, Vector,
    Visibility,
};
use raywright_cli::failure::{Exit, Failure};
use raywright_core::Observer;

use crate::array::{Array, ArrayData, import_numpy};
use crate::failure::{invalid_array, to_exception};
use crate::work::{self, WorkMonitor};

/// Number of rays between checks for Ctrl-C.
const RAYS_PER_CHECK: usize = 1024;

/// A bounding volume hierarchy over triangles, for ray queries.
///
/// vertices: of shape (n, 3), in any unit. triangles: of shape (m, 3), integers from 0. precision:
/// "robust" stores positions in single precision and computes hits in double; "reference" does both
/// in double. Watertight: no ray passes between triangles with common vertices.
#[pyclass(frozen, module = "raywright")]
pub struct Bvh(Arc<AnyPrecisionBvh>);

/// A bounding volume hierarchy in single or double precision.
enum AnyPrecisionBvh {
    Robust(Geometry<f32>),
    Reference(Geometry<f64>),
}

impl AnyPrecisionBvh {
    /// Returns the closest hit of each ray.
    fn closest(&self, rays: &RayBatch, watch: &WorkMonitor) -> Result<RayHits, Failure> {
        match self {
            Self::Robust(geometry) => rays.closest(geometry, watch),
            Self::Reference(geometry) => rays.closest(geometry, watch),
        }
    }

    /// Returns all hits of each ray.
    fn all_hits(&self, rays: &RayBatch, watch: &WorkMonitor) -> Result<RayHits, Failure> {
        match self {
            Self::Robust(geometry) => rays.all_hits(geometry, watch),
            Self::Reference(geometry) => rays.all_hits(geometry, watch),
        }
    }

    /// Returns for each ray whether anything is hit.
    fn occluded(&self, rays: &RayBatch, watch: &WorkMonitor) -> Result<Vec<bool>, Failure> {
        match self {
            Self::Robust(geometry) => rays.occluded(geometry, watch),
            Self::Reference(geometry) => rays.occluded(geometry, watch),
        }
    }
}

/// Hits: index of the ray, distance in lengths of its direction, index of the triangle, and two
/// barycentric coordinates.
#[derive(Default)]
struct RayHits {
    ray: Vec<i64>,
    t: Vec<f64>,
    triangle: Vec<i64>,
    uv: Vec<f64>,
}

impl RayHits {
    /// Adds a hit of a ray, or that it hits nothing.
    fn push<R: Real>(&mut self, ray: usize, hit: Option<Hit<R>>) {
        self.ray.push(ray as i64);
        self.t.push(hit.map_or(f64::INFINITY, |hit| hit.t.to_f64()));
        self.triangle
            .push(hit.map_or(-1, |hit| i64::from(hit.primitive)));
        self.uv
            .extend(hit.map_or([f64::NAN; 2], |hit| [hit.u.to_f64(), hit.v.to_f64()]));
    }

    /// Returns the columns as NumPy arrays: ray, distance, triangle and barycentric coordinates.
    fn into_arrays(self, py: Python<'_>) -> PyResult<[Bound<'_, PyAny>; 4]> {
        let count = self.t.len();
        Ok([
            Array::new(ArrayData::Integers(self.ray), &[count]).copy(py)?,
            Array::new(ArrayData::Doubles(self.t), &[count]).copy(py)?,
            Array::new(ArrayData::Integers(self.triangle), &[count]).copy(py)?,
            Array::new(ArrayData::Doubles(self.uv), &[count, 2]).copy(py)?,
        ])
    }
}

/// Rays of a query: origin and direction as six numbers per ray, and the range of distances common
/// to all rays.
struct RayBatch {
    numbers: Vec<f64>,
    range: [f64; 2],
}

impl RayBatch {
    /// Calls a query for each ray, and returns the results in the order of the rays.
    fn map_rays<T: Send, R: Real>(
        &self,
        watch: &WorkMonitor,
        ask: impl Fn(&Ray<R>, Interval<R>) -> T + Sync,
    ) -> Result<Vec<T>, Failure> {
        let [min, max] = self.range.map(R::from_f64);
        let vector =
            |v: &[f64]| R::Vec3::new(R::from_f64(v[0]), R::from_f64(v[1]), R::from_f64(v[2]));
        let compute = |ray: &[f64]| {
            ask(
                &Ray::new(vector(&ray[..3]), vector(&ray[3..])),
                Interval { min, max },
            )
        };
        let some = |rays: &[f64]| -> Vec<T> {
            let requested = if watch.is_cancelled() { &[] } else { rays };
            requested.chunks_exact(6).map(compute).collect()
        };
        let parts: Vec<Vec<T>> = self
            .numbers
            .par_chunks(6 * RAYS_PER_CHECK)
            .map(some)
            .collect();
        if watch.is_cancelled() {
            return Err(Failure::new(Exit::Interrupted, "interrupted"));
        }
        Ok(parts.into_iter().flatten().collect())
    }

    fn closest<R: Real>(
        &self,
        geometry: &Geometry<R>,
        watch: &WorkMonitor,
    ) -> Result<RayHits, Failure> {
        let found_hits = self.map_rays(watch, |ray: &Ray<R>, range| {
            geometry.closest(ray, range, &mut ())
        })?;
        let mut hits = RayHits::default();
        for (ray, hit) in found_hits.into_iter().enumerate() {
            hits.push(ray, hit);
        }
        Ok(hits)
    }

    /// Hits come in the order of rays, and of each ray by distance and triangle.
    fn all_hits<R: Real>(
        &self,
        geometry: &Geometry<R>,
        watch: &WorkMonitor,
    ) -> Result<RayHits, Failure> {
        let found_hits = self.map_rays(watch, |ray: &Ray<R>, range| {
            let mut hits = Vec::new();
            let mut collect = |hit: &Hit<R>| {
                hits.push(*hit);
                false
            };
            geometry.occluded(ray, range, &mut collect, &mut ());
            hits.sort_by(|a, b| {
                let distance = a.t.to_f64().total_cmp(&b.t.to_f64());
                distance.then(a.primitive.cmp(&b.primitive))
            });
            hits
        })?;
        let mut hits = RayHits::default();
        for (ray, own) in found_hits.into_iter().enumerate() {
            for hit in own {
                hits.push(ray, Some(hit));
            }
        }
        Ok(hits)
    }

    fn occluded<R: Real>(
        &self,
        geometry: &Geometry<R>,
        watch: &WorkMonitor,
    ) -> Result<Vec<bool>, Failure> {
        self.map_rays(watch, |ray: &Ray<R>, range| {
            geometry.occluded(ray, range, &mut |_| true, &mut ())
        })
    }
}

/// Builds the hierarchy over a mesh, in the precision `R`.
fn build_tree<R: Real>(vertices: &[f64], triangles: &[i64]) -> Result<Geometry<R>, Failure> {
    let corner = |vertex: i64| {
        let place = usize::try_from(vertex)
            .ok()
            .and_then(|vertex| vertex.checked_mul(3));
        let at = place.and_then(|index| vertices.get(index..index + 3));
        at.map(|v| R::Vec3::new(R::from_f64(v[0]), R::from_f64(v[1]), R::from_f64(v[2])))
    };
    let value_of = |number: usize| {
        let [a, b, c] = [0, 1, 2].map(|i| triangles[3 * number + i]);
        match [a, b, c].map(corner) {
            [Some(a), Some(b), Some(c)] => Ok([a, b, c]),
            _ => Err(invalid_array(format_args!(
                "triangles[{number}] is {a}, {b}, {c}, but the mesh has only {} vertices",
                vertices.len() / 3
            ))),
        }
    };
    let triangles = (0..triangles.len() / 3)
        .into_par_iter()
        .map(value_of)
        .collect::<Result<Vec<_>, _>>()?;
    let mut set = PrimitiveSet::default();
    // Filtered: `all_hits` sees each hit.
    let visibility = Visibility {
        occlusion: Occlusion::Filtered,
        ..Visibility::default()
    };
    set.add_mesh(triangles, visibility).map_err(invalid_array)?;
    Ok(Geometry::new(set, AcceleratorKind::default()))
}

/// Checks that an array has the shape (n, 3). Returns its numbers as bytes, row by row.
fn rows_to_bytes<'py>(
    of: &Bound<'py, PyAny>,
    name: &str,
    kind: &str,
) -> PyResult<Bound<'py, PyBytes>> {
    let py = of.py();
    let shape: Vec<usize> = of.getattr("shape")?.extract()?;
    if shape.len() != 2 || shape[1] != 3 {
        return Err(to_exception(
            py,
            invalid_array(format_args!(
                "{name} has the shape {shape:?}, but must have the shape (n, 3)"
            )),
        ));
    }
    Ok(of
        .call_method1("astype", (kind,))?
        .call_method0("tobytes")?
        .cast_into()?)
}

fn parse_doubles(bytes: &[u8]) -> Vec<f64> {
    bytes
        .as_chunks()
        .0
        .iter()
        .map(|&number| f64::from_ne_bytes(number))
        .collect()
}

/// Combines origins and directions to rays of six numbers. A single origin or a single direction
/// applies to all rays.
fn pair_rays(
    origins: &Bound<'_, PyAny>,
    directions: &Bound<'_, PyAny>,
    range: [f64; 2],
) -> PyResult<RayBatch> {
    let py = origins.py();
    let as_rows = |of: &Bound<'_, PyAny>| {
        import_numpy(py)?
            .call_method1("atleast_2d", (of,))
            .map(Bound::unbind)
    };
    let (origins, directions) = (
        as_rows(origins)?.into_bound(py),
        as_rows(directions)?.into_bound(py),
    );
    let pair = import_numpy(py)?.call_method1("broadcast_arrays", (&origins, &directions));
    let pair = pair.map_err(|_| {
        to_exception(
            py,
            invalid_array("origins and directions have different numbers of rays; give equally many, or a single one for all rays"),
        )
    })?;
    let [origins, directions] = [(0, "origins"), (1, "directions")]
        .map(|(i, name)| rows_to_bytes(&pair.get_item(i)?, name, "float64"));
    let [origins, directions] = [
        parse_doubles(origins?.as_bytes()),
        parse_doubles(directions?.as_bytes()),
    ];
    let both = origins
        .as_chunks::<3>()
        .0
        .iter()
        .zip(directions.as_chunks::<3>().0);
    Ok(RayBatch {
        numbers: both
            .flat_map(|(origin, direction)| [*origin, *direction])
            .flatten()
            .collect(),
        range,
    })
}

#[pymethods]
impl Bvh {
    #[new]
    #[pyo3(signature = (vertices, triangles, *, precision = "robust", threads = None))]
    fn new(
        vertices: &Bound<'_, PyAny>,
        triangles: &Bound<'_, PyAny>,
        precision: &str,
        threads: Option<u32>,
    ) -> PyResult<Self> {
        let py = vertices.py();
        let array = |of: &Bound<'_, PyAny>| {
            import_numpy(py)?
                .call_method1("asarray", (of,))
                .map(Bound::unbind)
        };
        let vertices = parse_doubles(
            rows_to_bytes(array(vertices)?.bind(py), "vertices", "float64")?.as_bytes(),
        );
        let triangles = rows_to_bytes(array(triangles)?.bind(py), "triangles", "int64")?;
        let triangles: Vec<i64> = triangles
            .as_bytes()
            .as_chunks()
            .0
            .iter()
            .map(|&number| i64::from_ne_bytes(number))
            .collect();
        let precision = precision.to_owned();
        let tree = work::run_work(py, threads, None, move |_| match precision.as_str() {
            "robust" => Ok(AnyPrecisionBvh::Robust(build_tree(&vertices, &triangles)?)),
            "reference" => Ok(AnyPrecisionBvh::Reference(build_tree(
                &vertices, &triangles,
            )?)),
            other => {
                let failure = Failure::new(
                    Exit::Usage,
                    format_args!("the precision `{other}` is unknown"),
                );
                Err(failure.with_hint("known: robust, reference"))
            }
        })?;
        Ok(Self(Arc::new(tree)))
    }

    /// The closest hit of each ray with tmin < t < tmax.
    ///
    /// origins, directions: of shape (n, 3), or (3,) for all. Returns (t, triangle, uv): distances
    /// in lengths of the direction, float64 of shape (n,), infinite without a hit; indices of
    /// triangles, int64 of shape (n,), -1 without a hit; and barycentric coordinates, float64 of
    /// shape (n, 2): the hit is (1 - u - v) a + u b + v c for the triangle's vertices a, b, c.
    #[pyo3(signature = (origins, directions, *, tmin = 0.0, tmax = f64::INFINITY, threads = None))]
    fn closest<'py>(
        &self,
        origins: &Bound<'py, PyAny>,
        directions: &Bound<'py, PyAny>,
        tmin: f64,
        tmax: f64,
        threads: Option<u32>,
    ) -> PyResult<Bound<'py, PyTuple>> {
        let (py, rays, tree) = (
            origins.py(),
            pair_rays(origins, directions, [tmin, tmax])?,
            Arc::clone(&self.0),
        );
        let hits = work::run_work(py, threads, None, move |watch| tree.closest(&rays, watch))?;
        PyTuple::new(py, &hits.into_arrays(py)?[1..])
    }

    /// All hits of each ray with tmin < t < tmax, in the order of the rays, and of each ray by
    /// distance.
    ///
    /// Returns (ray, t, triangle, uv): one entry a hit, with the index of its ray, int64, and the
    /// rest as `closest` returns them. A ray through a common edge may meet both triangles.
    #[pyo3(signature = (origins, directions, *, tmin = 0.0, tmax = f64::INFINITY, threads = None))]
    fn all_hits<'py>(
        &self,
        origins: &Bound<'py, PyAny>,
        directions: &Bound<'py, PyAny>,
        tmin: f64,
        tmax: f64,
        threads: Option<u32>,
    ) -> PyResult<Bound<'py, PyTuple>> {
        let (py, rays, tree) = (
            origins.py(),
            pair_rays(origins, directions, [tmin, tmax])?,
            Arc::clone(&self.0),
        );
        let hits = work::run_work(py, threads, None, move |watch| tree.all_hits(&rays, watch))?;
        PyTuple::new(py, hits.into_arrays(py)?)
    }

    /// Whether each ray has any hit with tmin < t < tmax: bool of shape (n,).
    #[pyo3(signature = (origins, directions, *, tmin = 0.0, tmax = f64::INFINITY, threads = None))]
    fn occluded<'py>(
        &self,
        origins: &Bound<'py, PyAny>,
        directions: &Bound<'py, PyAny>,
        tmin: f64,
        tmax: f64,
        threads: Option<u32>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (py, rays, tree) = (
            origins.py(),
            pair_rays(origins, directions, [tmin, tmax])?,
            Arc::clone(&self.0),
        );
        let hit = work::run_work(py, threads, None, move |watch| tree.occluded(&rays, watch))?;
        let count = hit.len();
        Array::new(ArrayData::Booleans(hit), &[count]).copy(py)
    }
}
