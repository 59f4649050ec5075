//! Compressed data: buffer views by meshoptimizer's codecs (EXT_meshopt_compression,
//! KHR_meshopt_compression) and whole primitives by Draco (KHR_draco_mesh_compression), decoded
//! before any other use.

use std::collections::HashMap;

use draco_core::{DecodeLimits, DecoderBuffer, MeshDecoder};

use super::accessor::{Component, arity};
use super::buffers::{Buffers, absent};
use super::document::Document;
use super::entries::{Draco, Meshopt, Primitive, ViewExtensions};
use crate::import::{DecodeBudget, Fault, Outcome, printable};
use crate::{Limits, meshopt};

/// Decodes all compressed buffer views and primitives, and stores the decoded bytes in `buffers`.
///
/// # Errors
/// A fault of kind input at a view or primitive with invalid data, of kind limit beyond the memory
/// limit.
pub(super) fn decode(
    document: &Document,
    buffers: &mut Buffers<'_>,
    limits: &Limits,
    budget: &mut DecodeBudget,
) -> Outcome<()> {
    for (i, view) in document.buffer_views.iter().enumerate() {
        let ViewExtensions {
            ext_meshopt,
            khr_meshopt,
        } = &view.extensions;
        let ext = ext_meshopt
            .as_ref()
            .map(|packed| ("EXT_meshopt_compression", packed));
        let Some((name, packed)) = ext.or(khr_meshopt
            .as_ref()
            .map(|packed| ("KHR_meshopt_compression", packed)))
        else {
            continue;
        };
        let place = |fault: Fault| fault.with_place(format_args!("bufferViews[{i}]: {name}"));
        let bytes = unpacked(packed, buffers, budget).map_err(place)?;
        if (bytes.len() as u64) < view.byte_length {
            let length = view.byte_length;
            return Err(place(Fault::input(format!(
                "holds {} bytes, and the view has {length}",
                bytes.len()
            ))));
        }
        buffers.replace_view(i, bytes);
    }
    let primitives = document
        .meshes
        .iter()
        .enumerate()
        .flat_map(|(m, mesh)| mesh.primitives.iter().enumerate().map(move |p| (m, p)));
    for (mesh, (part, primitive)) in primitives {
        let Some(packed) = &primitive.extensions.draco else {
            continue;
        };
        let place = |fault: Fault| {
            fault.with_place(format_args!(
                "meshes[{mesh}].primitives[{part}]: KHR_draco_mesh_compression"
            ))
        };
        draco(document, primitive, packed, buffers, limits, budget).map_err(place)?;
    }
    Ok(())
}

/// Decodes a buffer view that meshoptimizer compressed, and applies its filter.
fn unpacked(view: &Meshopt, buffers: &Buffers<'_>, budget: &mut DecodeBudget) -> Outcome<Vec<u8>> {
    let source = buffers.bytes(view.buffer as usize, view.byte_offset, view.byte_length)?;
    let number = |x: u64| usize::try_from(x).unwrap_or(usize::MAX);
    let (count, stride) = (number(view.count), number(view.byte_stride));
    budget.memory(count, stride)?;
    let broken = |reason: meshopt::Broken| Fault::input(format!("is broken ({reason})"));
    let decode = match view.mode.as_str() {
        "ATTRIBUTES" => meshopt::vertices,
        "TRIANGLES" => meshopt::triangles,
        "INDICES" => meshopt::sequence,
        other => {
            return Err(Fault::input(format!(
                "has the unknown mode {}",
                printable(other)
            )));
        }
    };
    let mut bytes = decode(count, stride, source).map_err(broken)?;
    let filter = match view.filter.as_deref().unwrap_or("NONE") {
        "NONE" => return Ok(bytes),
        "OCTAHEDRAL" => meshopt::octahedral,
        "QUATERNION" => meshopt::quaternions,
        "EXPONENTIAL" => meshopt::exponential,
        "COLOR" => meshopt::colours,
        other => {
            return Err(Fault::input(format!(
                "has the unknown filter {}",
                printable(other)
            )));
        }
    };
    filter(stride, &mut bytes).map_err(broken)?;
    Ok(bytes)
}

/// Decodes a Draco-compressed primitive and stores the decoded elements of its accessors.
fn draco(
    document: &Document,
    primitive: &Primitive,
    draco: &Draco,
    buffers: &mut Buffers<'_>,
    limits: &Limits,
    budget: &mut DecodeBudget,
) -> Outcome<()> {
    let (bytes, _) = buffers.view(document, draco.buffer_view as usize)?;
    let mut most = DecodeLimits::default();
    (most.max_points, most.max_faces) = (limits.triangles.saturating_mul(3), limits.triangles);
    most.max_decoded_bytes = limits.memory_bytes;
    let mut mesh = draco_core::Mesh::new();
    let mut input = DecoderBuffer::new(bytes).with_limits(most);
    MeshDecoder::new()
        .decode(&mut input, &mut mesh)
        .map_err(|e| Fault::input(format!("is broken ({e})")))?;
    let mut filled = HashMap::new();
    for (name, &id) in &draco.attributes {
        let Some(&accessor) = primitive.attributes.get(name) else {
            continue;
        };
        let attribute = mesh.attribute_by_unique_id(id);
        let attribute = attribute.ok_or_else(|| {
            Fault::input(format!("has no attribute {id} for {}", printable(name)))
        })?;
        let layout = layout(document, accessor, mesh.num_points())
            .map_err(|fault| fault.with_place(printable(name)))?;
        budget.memory(
            mesh.num_points() * layout.arity,
            layout.component.size() + size_of::<f32>(),
        )?;
        let values = attribute.read_f32s(mesh.num_points(), layout.arity);
        filled.insert(accessor as usize, written(&values, layout.component));
    }
    if let Some(accessor) = primitive.indices {
        let corners = mesh.num_faces() * 3;
        let layout =
            layout(document, accessor, corners).map_err(|fault| fault.with_place("indices"))?;
        budget.memory(corners, layout.component.size())?;
        let indices = mesh.faces().iter().flatten().map(|point| point.0);
        let bytes = match layout.component.size() {
            1 => indices.map(|i| i as u8).collect(),
            2 => indices.flat_map(|i| (i as u16).to_le_bytes()).collect(),
            _ => indices.flat_map(u32::to_le_bytes).collect(),
        };
        filled.insert(accessor as usize, bytes);
    }
    filled
        .into_iter()
        .for_each(|(accessor, bytes)| buffers.fill_accessor(accessor, bytes));
    Ok(())
}

/// Component type of an accessor, and number of components per element.
struct AccessorLayout {
    component: Component,
    arity: usize,
}

/// Returns the layout of an accessor. Refuses an accessor whose count differs from `decoded`, the
/// number of decoded elements.
fn layout(document: &Document, index: u32, decoded: usize) -> Outcome<AccessorLayout> {
    let list = &document.accessors;
    let accessor = list
        .get(index as usize)
        .ok_or_else(|| absent("accessors", index as usize, list.len()))?;
    let place = |fault: Fault| fault.with_place(format_args!("accessors[{index}]"));
    if accessor.count != decoded as u64 {
        let message = format!(
            "counts {} elements, and {decoded} were decoded",
            accessor.count
        );
        return Err(place(Fault::input(message)));
    }
    let component = Component::of(accessor.component_type).map_err(place)?;
    match arity(&accessor.kind).map_err(place)? {
        arity @ 1..=4 => Ok(AccessorLayout { component, arity }),
        _ => Err(place(Fault::input("is a matrix"))),
    }
}

/// Converts numbers to an accessor's component type.
fn written(values: &[f32], component: Component) -> Vec<u8> {
    let list = values.iter();
    match component {
        Component::I8 => list.flat_map(|&x| (x as i8).to_le_bytes()).collect(),
        Component::U8 => list.map(|&x| x as u8).collect(),
        Component::I16 => list.flat_map(|&x| (x as i16).to_le_bytes()).collect(),
        Component::U16 => list.flat_map(|&x| (x as u16).to_le_bytes()).collect(),
        Component::U32 => list.flat_map(|&x| (x as u32).to_le_bytes()).collect(),
        Component::F32 => list.flat_map(|&x| x.to_le_bytes()).collect(),
    }
}
