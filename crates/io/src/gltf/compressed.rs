//! Data that extensions compress: buffer views by meshoptimizer's codecs (EXT_meshopt_compression, KHR_meshopt_compression) and
//! whole primitives by Draco (KHR_draco_mesh_compression), both decoded before anything reads them.

use std::collections::{BTreeMap, HashMap};

use draco_core::{DecodeLimits, DecoderBuffer, Mesh, MeshDecoder};
use gltf::json;
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::mesh::Primitive;
use gltf::json::validation::Checked;
use meshoptimizer_rs::codec;
use meshoptimizer_rs::{Limits as CodecLimits, Workspace};
use serde::Deserialize;
use serde_json::{Map, Value};

use super::buffers::{Buffers, absent};
use super::document::Document;
use crate::Limits;
use crate::import::{Budget, Fault, Outcome, shown};

/// The names under which buffer views are compressed by meshoptimizer's codecs; the second allows a later version of them.
const MESHOPT: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

const DRACO: &str = "KHR_draco_mesh_compression";

/// What a compressed buffer view says of its data.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct View {
    buffer: u32,
    #[serde(default)]
    byte_offset: u64,
    byte_length: u64,
    byte_stride: u64,
    count: u64,
    mode: String,
    filter: Option<String>,
}

/// What a compressed primitive says of its data.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Draco {
    buffer_view: u32,
    attributes: BTreeMap<String, u32>,
}

/// Decodes everything that is compressed and puts it in place of what it stands for.
///
/// # Errors
/// A fault of kind input at the view or the primitive whose data is wrong, of kind limit where it takes too much memory.
pub(super) fn decode(document: &Document, buffers: &mut Buffers<'_>, limits: &Limits, budget: &mut Budget) -> Outcome<()> {
    for (i, view) in document.buffer_views.iter().enumerate() {
        let others = view.extensions.as_ref().map(|extensions| &extensions.others);
        let Some((name, value)) = MESHOPT.iter().find_map(|name| Some((*name, others?.get(*name)?))) else { continue };
        let place = |fault: Fault| fault.at(format_args!("bufferViews[{i}]: {name}"));
        let bytes = meshopt(value, buffers, budget).map_err(place)?;
        if (bytes.len() as u64) < view.byte_length.0 {
            let length = view.byte_length.0;
            return Err(place(Fault::input(format!("holds {} bytes, and the view has {length}", bytes.len()))));
        }
        buffers.replace_view(i, bytes);
    }
    let primitives =
        document.meshes.iter().enumerate().flat_map(|(m, mesh)| mesh.primitives.iter().enumerate().map(move |p| (m, p)));
    for (mesh, (part, primitive)) in primitives {
        let Some(value) = extension(primitive).and_then(|others| others.get(DRACO)) else { continue };
        let place = |fault: Fault| fault.at(format_args!("meshes[{mesh}].primitives[{part}]: {DRACO}"));
        draco(document, primitive, value, buffers, limits, budget).map_err(place)?;
    }
    Ok(())
}

fn extension(primitive: &Primitive) -> Option<&Map<String, Value>> {
    primitive.extensions.as_ref().map(|extensions| &extensions.others)
}

fn parsed<T: for<'de> Deserialize<'de>>(value: &Value) -> Outcome<T> {
    T::deserialize(value).map_err(|e| Fault::input(e.to_string()))
}

/// The bytes of a compressed view.
fn meshopt(value: &Value, buffers: &Buffers<'_>, budget: &mut Budget) -> Outcome<Vec<u8>> {
    let view: View = parsed(value)?;
    let source = buffers.bytes(view.buffer as usize, view.byte_offset, view.byte_length)?;
    let number = |x: u64| usize::try_from(x).unwrap_or(usize::MAX);
    let (count, stride) = (number(view.count), number(view.byte_stride));
    budget.memory(count, stride)?;
    let whole = count.checked_mul(stride).ok_or_else(|| Fault::limit(format!("counts {count} elements")))?;
    let room = CodecLimits { max_bytes: whole.saturating_mul(2).saturating_add(1 << 20), ..CodecLimits::default() };
    let mut workspace = Workspace::new(room);
    let broken = |e: meshoptimizer_rs::Error| Fault::input(format!("is broken ({e})"));
    let mut bytes = match view.mode.as_str() {
        "ATTRIBUTES" => codec::decode_vertex_buffer(count, stride, source, &mut workspace).map_err(broken)?,
        "TRIANGLES" => codec::decode_index_buffer(count, stride, source, &mut workspace).map_err(broken)?,
        "INDICES" => codec::decode_index_sequence(count, stride, source, &mut workspace).map_err(broken)?,
        other => return Err(Fault::input(format!("has the unknown mode {}", shown(other)))),
    };
    match view.filter.as_deref().unwrap_or("NONE") {
        "NONE" => {}
        "OCTAHEDRAL" => codec::decode_filter_oct(&mut bytes, count, stride, &mut workspace).map_err(broken)?,
        "QUATERNION" => codec::decode_filter_quat(&mut bytes, count, stride, &mut workspace).map_err(broken)?,
        "EXPONENTIAL" => codec::decode_filter_exp(&mut bytes, count, stride, &mut workspace).map_err(broken)?,
        "COLOR" => codec::decode_filter_color(&mut bytes, count, stride, &mut workspace).map_err(broken)?,
        other => return Err(Fault::input(format!("has the unknown filter {}", shown(other)))),
    }
    Ok(bytes)
}

/// Decodes a primitive and gives its accessors what they stand for.
fn draco(
    document: &Document,
    primitive: &Primitive,
    value: &Value,
    buffers: &mut Buffers<'_>,
    limits: &Limits,
    budget: &mut Budget,
) -> Outcome<()> {
    let draco: Draco = parsed(value)?;
    let (bytes, _) = buffers.view(document, draco.buffer_view as usize)?;
    let mut most = DecodeLimits::default();
    (most.max_points, most.max_faces) = (limits.triangles.saturating_mul(3), limits.triangles);
    most.max_decoded_bytes = limits.memory_bytes;
    let mut mesh = Mesh::new();
    let mut input = DecoderBuffer::new(bytes).with_limits(most);
    MeshDecoder::new().decode(&mut input, &mut mesh).map_err(|e| Fault::input(format!("is broken ({e})")))?;
    let mut filled = HashMap::new();
    for (name, &id) in &draco.attributes {
        let semantic = primitive.attributes.iter().find(|(semantic, _)| match semantic {
            Checked::Valid(semantic) => semantic.to_string() == *name,
            Checked::Invalid => false,
        });
        let Some((_, accessor)) = semantic else { continue };
        let attribute = mesh.attribute_by_unique_id(id);
        let attribute = attribute.ok_or_else(|| Fault::input(format!("has no attribute {id} for {}", shown(name))))?;
        let layout = layout(document, accessor.value(), mesh.num_points()).map_err(|fault| fault.at(shown(name)))?;
        budget.memory(mesh.num_points() * layout.arity, layout.component.size() + size_of::<f32>())?;
        let values = attribute.read_f32s(mesh.num_points(), layout.arity);
        filled.insert(accessor.value(), written(&values, layout.component));
    }
    if let Some(accessor) = &primitive.indices {
        let corners = mesh.num_faces() * 3;
        let layout = layout(document, accessor.value(), corners).map_err(|fault| fault.at("indices"))?;
        budget.memory(corners, layout.component.size())?;
        let indices = mesh.faces().iter().flatten().map(|point| point.0);
        let bytes = match layout.component.size() {
            1 => indices.map(|i| i as u8).collect(),
            2 => indices.flat_map(|i| (i as u16).to_le_bytes()).collect(),
            _ => indices.flat_map(u32::to_le_bytes).collect(),
        };
        filled.insert(accessor.value(), bytes);
    }
    filled.into_iter().for_each(|(accessor, bytes)| buffers.fill_accessor(accessor, bytes));
    Ok(())
}

/// How an accessor stores its elements.
struct Layout {
    component: ComponentType,
    arity: usize,
}

/// The layout of an accessor that counts as many elements as were decoded.
fn layout(document: &Document, index: usize, decoded: usize) -> Outcome<Layout> {
    let list = &document.accessors;
    let accessor: &json::Accessor = list.get(index).ok_or_else(|| absent("accessors", index, list.len()))?;
    if accessor.count.0 != decoded as u64 {
        return Err(Fault::input(format!("accessors[{index}] counts {} elements, and {decoded} were decoded", accessor.count.0)));
    }
    let (Checked::Valid(component), Checked::Valid(kind)) = (accessor.component_type, accessor.type_) else {
        return Err(Fault::input(format!("accessors[{index}] has an unknown type")));
    };
    let arity = match kind {
        Type::Scalar => 1,
        Type::Vec2 => 2,
        Type::Vec3 => 3,
        Type::Vec4 => 4,
        _ => return Err(Fault::input(format!("accessors[{index}] is a matrix"))),
    };
    Ok(Layout { component: component.0, arity })
}

/// Numbers as an accessor stores them.
fn written(values: &[f32], component: ComponentType) -> Vec<u8> {
    let list = values.iter();
    match component {
        ComponentType::I8 => list.flat_map(|&x| (x as i8).to_le_bytes()).collect(),
        ComponentType::U8 => list.map(|&x| x as u8).collect(),
        ComponentType::I16 => list.flat_map(|&x| (x as i16).to_le_bytes()).collect(),
        ComponentType::U16 => list.flat_map(|&x| (x as u16).to_le_bytes()).collect(),
        ComponentType::U32 => list.flat_map(|&x| (x as u32).to_le_bytes()).collect(),
        ComponentType::F32 => list.flat_map(|&x| x.to_le_bytes()).collect(),
    }
}
