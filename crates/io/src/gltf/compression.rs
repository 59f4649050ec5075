//! Compressed data: buffer views by meshoptimizer's codecs (EXT_meshopt_compression,
//! KHR_meshopt_compression) and whole primitives by Draco (KHR_draco_mesh_compression), decoded
//! before any other use.

use std::collections::HashMap;

use draco_core::{DecodeLimits, DecoderBuffer, MeshDecoder};

use super::accessor::{Buffers, ComponentType, element_arity, find_entry};
use super::document::Document;
use super::entries::{DracoEntry, MeshoptEntry, PrimitiveEntry, ViewExtensions};
use crate::import::{DecodeBudget, Fault, FaultPlace, ImportResult, sanitise_text};
use crate::{Limits, meshopt};

/// Decodes all compressed buffer views and primitives, and stores the decoded bytes in `buffers`.
///
/// # Errors
/// A fault of kind input at a view or primitive with invalid data, of kind limit beyond the memory
/// limit.
pub(super) fn decode_compressed_data(
    document: &Document,
    buffers: &mut Buffers<'_>,
    limits: &Limits,
    budget: &mut DecodeBudget,
) -> ImportResult<()> {
    for (i, view) in document.buffer_views.iter().enumerate() {
        let ViewExtensions {
            ext_meshopt,
            khr_meshopt,
        } = &view.extensions;
        let ext = ext_meshopt
            .as_ref()
            .map(|compressed| ("EXT_meshopt_compression", compressed));
        let Some((name, compressed)) = ext.or(khr_meshopt
            .as_ref()
            .map(|compressed| ("KHR_meshopt_compression", compressed)))
        else {
            continue;
        };
        let place = |fault: Fault| fault.with_place(format_args!("bufferViews[{i}]: {name}"));
        let bytes = decode_meshopt_view(compressed, buffers, budget).map_err(place)?;
        if (bytes.len() as u64) < view.byte_length {
            let length = view.byte_length;
            return Err(place(fault!(
                "decodes to {} bytes, but the buffer view has {length} bytes",
                bytes.len()
            )));
        }
        buffers.set_decoded_view(i, bytes);
    }
    let primitives = document
        .meshes
        .iter()
        .enumerate()
        .flat_map(|(m, mesh)| mesh.primitives.iter().enumerate().map(move |p| (m, p)));
    for (mesh, (part, primitive)) in primitives {
        let Some(compressed) = &primitive.extensions.draco else {
            continue;
        };
        decode_draco(document, primitive, compressed, buffers, limits, budget).with_place(
            format_args!("meshes[{mesh}].primitives[{part}]: KHR_draco_mesh_compression"),
        )?;
    }
    Ok(())
}

/// Decodes a buffer view that meshoptimizer compressed, and applies its filter.
fn decode_meshopt_view(
    view: &MeshoptEntry,
    buffers: &Buffers<'_>,
    budget: &mut DecodeBudget,
) -> ImportResult<Vec<u8>> {
    let source = buffers.buffer_range(view.buffer as usize, view.byte_offset, view.byte_length)?;
    let number = |x: u64| usize::try_from(x).unwrap_or(usize::MAX);
    let (count, stride) = (number(view.count), number(view.byte_stride));
    budget.reserve_memory(count, stride)?;
    let broken = |reason: meshopt::PacketFault| fault!("is broken ({reason})");
    let decode = match view.mode.as_str() {
        "ATTRIBUTES" => meshopt::decode_vertices,
        "TRIANGLES" => meshopt::decode_triangles,
        "INDICES" => meshopt::decode_index_sequence,
        other => {
            return Err(fault!("has the unknown mode {}", sanitise_text(other)));
        }
    };
    let mut bytes = decode(count, stride, source).map_err(broken)?;
    let filter = match view.filter.as_deref().unwrap_or("NONE") {
        "NONE" => return Ok(bytes),
        "OCTAHEDRAL" => meshopt::decode_octahedral,
        "QUATERNION" => meshopt::decode_quaternions,
        "EXPONENTIAL" => meshopt::decode_exponential,
        "COLOR" => meshopt::decode_colours,
        other => {
            return Err(fault!("has the unknown filter {}", sanitise_text(other)));
        }
    };
    filter(stride, &mut bytes).map_err(broken)?;
    Ok(bytes)
}

/// Decodes a Draco-compressed primitive and stores the decoded elements of its accessors.
fn decode_draco(
    document: &Document,
    primitive: &PrimitiveEntry,
    draco: &DracoEntry,
    buffers: &mut Buffers<'_>,
    limits: &Limits,
    budget: &mut DecodeBudget,
) -> ImportResult<()> {
    let (bytes, _) = buffers.view_bytes(document, draco.buffer_view as usize)?;
    let mut most = DecodeLimits::default();
    (most.max_points, most.max_faces) = (limits.triangles.saturating_mul(3), limits.triangles);
    most.max_decoded_bytes = limits.memory_bytes;
    let mut mesh = draco_core::Mesh::new();
    let mut input = DecoderBuffer::new(bytes).with_limits(most);
    MeshDecoder::new()
        .decode(&mut input, &mut mesh)
        .map_err(|e| fault!("is broken ({e})"))?;
    let mut accessor_bytes = HashMap::new();
    for (name, &id) in &draco.attributes {
        let Some(&accessor) = primitive.attributes.get(name) else {
            continue;
        };
        let attribute = mesh.attribute_by_unique_id(id);
        let attribute = attribute.ok_or_else(|| {
            fault!("the compressed data has no attribute with the identifier {id}, which the primitive uses as {}", sanitise_text(name))
        })?;
        let layout = accessor_layout(document, accessor, mesh.num_points())
            .with_place(sanitise_text(name))?;
        budget.reserve_memory(
            mesh.num_points() * layout.arity,
            layout.component.size() + size_of::<f32>(),
        )?;
        let values = attribute.read_f32s(mesh.num_points(), layout.arity);
        accessor_bytes.insert(
            accessor as usize,
            encode_components(&values, layout.component),
        );
    }
    if let Some(accessor) = primitive.indices {
        let corners = mesh.num_faces() * 3;
        let layout = accessor_layout(document, accessor, corners).with_place("indices")?;
        budget.reserve_memory(corners, layout.component.size())?;
        let indices = mesh.faces().iter().flatten().map(|point| point.0);
        let bytes = match layout.component.size() {
            1 => indices.map(|i| i as u8).collect(),
            2 => indices.flat_map(|i| (i as u16).to_le_bytes()).collect(),
            _ => indices.flat_map(u32::to_le_bytes).collect(),
        };
        accessor_bytes.insert(accessor as usize, bytes);
    }
    accessor_bytes
        .into_iter()
        .for_each(|(accessor, bytes)| buffers.set_decoded_accessor(accessor, bytes));
    Ok(())
}

/// Component type of an accessor, and number of components per element.
struct AccessorLayout {
    component: ComponentType,
    arity: usize,
}

/// Returns component type and arity of an accessor. An accessor is refused if its element count
/// differs from `decoded`, the number of elements in the decompressed data.
fn accessor_layout(
    document: &Document,
    index: u32,
    decoded: usize,
) -> ImportResult<AccessorLayout> {
    let accessor = find_entry(&document.accessors, "accessors", index as usize)?;
    let place = |fault: Fault| fault.with_place(format_args!("accessors[{index}]"));
    if accessor.count != decoded as u64 {
        let message = format!(
            "has {} elements, but the compressed data contains {decoded}",
            accessor.count
        );
        return Err(place(Fault::invalid_input(message)));
    }
    let component = ComponentType::from_code(accessor.component_type).map_err(place)?;
    match element_arity(&accessor.kind).map_err(place)? {
        arity @ 1..=4 => Ok(AccessorLayout { component, arity }),
        _ => Err(place(fault!(
            "has a matrix type, which a compressed attribute cannot have"
        ))),
    }
}

/// Encodes decoded numbers as little-endian bytes of an accessor's component type.
fn encode_components(values: &[f32], component: ComponentType) -> Vec<u8> {
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
