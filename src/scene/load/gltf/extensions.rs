//! Which extensions are known: a required one is never ignored, an optional one that changes the image is reported.

use super::document::Document;
use crate::scene::load::{LoadError, Warning};

/// Extensions that are honoured.
const HONOURED: &[&str] = &[
    "EXT_mesh_gpu_instancing",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_unlit",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// Extensions without which a file looks the same.
const HARMLESS: &[&str] = &[
    "KHR_animation_pointer",
    "KHR_materials_variants",
    "KHR_xmp",
    "KHR_xmp_json_ld",
    "EXT_structural_metadata",
    "EXT_mesh_features",
    "AGI_articulations",
    "MSFT_lod",
    "MSFT_packing_normalRoughnessMetallic",
    "MSFT_packing_occlusionRoughnessMetallic",
];

/// Checks what a file requires and uses.
///
/// # Errors
/// [`LoadError::Invalid`] that names a required extension that is not honoured.
pub fn check(document: &Document<'_>, warnings: &mut Vec<Warning>) -> Result<(), LoadError> {
    let known = |name: &str| HONOURED.contains(&name) || HARMLESS.contains(&name);
    let root = &document.root;
    if let Some(name) = root.extensions_required.iter().find(|name| !known(name)) {
        let problem = format!("{} is required, but not supported", name.escape_debug());
        return Err(document.error("extensionsRequired", problem));
    }
    let mut reported: Vec<&str> = Vec::new();
    for name in root.extensions_used.iter().filter(|name| !known(name)) {
        if !reported.contains(&name.as_str()) {
            reported.push(name);
            let message = format!("extension {} is not supported, the image may differ", name.escape_debug());
            warnings.push(document.warning(message));
        }
    }
    Ok(())
}
