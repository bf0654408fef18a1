//! Materials: metallic-roughness to k_d, k_s and Emiss. The mapping is explained in docs/scenes.md.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{Affine2, Vec2, Vec3};
use gltf_json::material::AlphaMode;
use gltf_json::texture::{Info, WrappingMode};
use gltf_json::validation::Checked;

use super::document::Document;
use crate::scene::load::{LoadError, Warning, images};
use crate::scene::{AlphaMask, Material, Texture, TextureMap, Wrap};

/// Reflectance of non-metals at normal incidence, as glTF has it.
const DIELECTRIC: f32 = 0.04;
/// Mirrors weaker than this in all channels are left out: they cost a ray per pixel and are hardly seen.
const FAINTEST_MIRROR: f32 = 0.005;
/// `BLEND` materials are opaque where their coverage reaches this.
const BLEND_CUTOFF: f32 = 0.5;

/// A material with what belongs to the meshes that use it.
pub struct Converted {
    /// The material.
    pub material: Material,
    /// Set of texture coordinates that it uses.
    pub uv_set: u32,
}

/// Converts the materials of a file; every image is decoded once.
pub struct Materials<'a> {
    document: &'a Document<'a>,
    images: HashMap<usize, Option<Arc<Texture>>>,
    warnings: &'a mut Vec<Warning>,
}

impl<'a> Materials<'a> {
    /// Converts all materials, in order.
    ///
    /// # Errors
    /// [`LoadError::Invalid`] for values that are not finite or negative, and textures that don't exist. An image
    /// that can't be read is a warning.
    pub fn convert(
        document: &'a Document<'a>,
        warnings: &'a mut Vec<Warning>,
    ) -> Result<Vec<Converted>, LoadError> {
        let mut materials = Materials { document, images: HashMap::new(), warnings };
        (0..document.root.materials.len()).map(|index| materials.one(index)).collect()
    }

    fn one(&mut self, index: usize) -> Result<Converted, LoadError> {
        let document = self.document;
        let source = &document.root.materials[index];
        let place = format!("materials[{index}]");
        let name = source.name.clone().unwrap_or_default();
        let pbr = &source.pbr_metallic_roughness;
        let extensions = source.extensions.as_ref();
        let gloss = extensions.and_then(|e| e.pbr_specular_glossiness.as_ref());
        let (base, base_texture) = match gloss {
            Some(gloss) => (gloss.diffuse_factor.0, gloss.diffuse_texture.as_ref()),
            None => (pbr.base_color_factor.0, pbr.base_color_texture.as_ref()),
        };
        let color = Vec3::new(base[0], base[1], base[2]);
        let strength = extensions
            .and_then(|extensions| extensions.emissive_strength.as_ref())
            .map_or(1.0, |extension| extension.emissive_strength.0);
        let mut emission = Vec3::from_array(source.emissive_factor.0) * strength;
        let (diffuse, mut specular) = match gloss {
            Some(gloss) => {
                let mirror = mirror_share(1.0 - gloss.glossiness_factor.0);
                (color, Vec3::from_array(gloss.specular_factor.0) * mirror)
            }
            None => {
                let mut metallic = pbr.metallic_factor.0;
                let mut roughness = pbr.roughness_factor.0;
                if let Some(info) = &pbr.metallic_roughness_texture
                    && let Some(texture) = self.image(info.index.value(), &place)?
                {
                    // Both vary over the surface there; k_s does not.
                    let mean = texture.mean();
                    metallic *= mean[2];
                    roughness *= mean[1];
                }
                metallic_roughness(color, metallic, roughness)
            }
        };
        for value in [diffuse, specular, emission, Vec3::splat(base[3])] {
            if !value.is_finite() || value.min_element() < 0.0 {
                let problem = "its factors must be finite and not negative".to_owned();
                return Err(document.error(&place, problem));
            }
        }
        if specular.max_element() < FAINTEST_MIRROR {
            specular = Vec3::ZERO;
        }
        let mut uv_set = None;
        let mut diffuse_map = self.map(base_texture, &place, &mut uv_set)?;
        let mut emission_map = match emission == Vec3::ZERO {
            true => None,
            false => self.map(source.emissive_texture.as_ref(), &place, &mut uv_set)?,
        };
        let alpha_mask = self.alpha_mask(source, base[3], diffuse_map.as_ref(), &place)?;
        let mut diffuse = diffuse;
        if extensions.is_some_and(|extensions| extensions.unlit.is_some()) {
            // The surface looks the same in any light: it sends its colour out by itself.
            emission = color;
            emission_map = diffuse_map.take();
            (diffuse, specular) = (Vec3::ZERO, Vec3::ZERO);
        }
        let two_sided = source.double_sided;
        let material = Material {
            name,
            diffuse,
            specular,
            emission,
            lamp: false,
            two_sided,
            cull: false,
            diffuse_map,
            emission_map,
            alpha_mask,
        };
        Ok(Converted { material, uv_set: uv_set.unwrap_or(0) })
    }

    fn alpha_mask(
        &mut self,
        source: &gltf_json::Material,
        alpha: f32,
        map: Option<&TextureMap>,
        place: &str,
    ) -> Result<Option<AlphaMask>, LoadError> {
        let cutoff = match source.alpha_mode {
            Checked::Valid(AlphaMode::Opaque) => return Ok(None),
            Checked::Valid(AlphaMode::Mask) => {
                source.alpha_cutoff.map_or(0.5, |cutoff| cutoff.0.clamp(0.0, f32::MAX))
            }
            Checked::Valid(AlphaMode::Blend) => BLEND_CUTOFF,
            Checked::Invalid => {
                return Err(self.document.error(&format!("{place}.alphaMode"), "is unknown".to_owned()));
            }
        };
        let mask = AlphaMask { map: map.cloned(), alpha, cutoff };
        if mask.is_solid() {
            return Ok(None);
        }
        if matches!(source.alpha_mode, Checked::Valid(AlphaMode::Blend)) {
            self.warn(format!(
                "{place} is translucent: opaque where alpha reaches {BLEND_CUTOFF}, left out elsewhere"
            ));
        }
        Ok(Some(mask))
    }

    /// A texture as the material uses it. All of a material's textures must use one set of coordinates.
    fn map(
        &mut self,
        info: Option<&Info>,
        place: &str,
        uv_set: &mut Option<u32>,
    ) -> Result<Option<TextureMap>, LoadError> {
        let Some(info) = info else { return Ok(None) };
        let Some(texture) = self.image(info.index.value(), place)? else { return Ok(None) };
        let extension = info.extensions.as_ref().and_then(|e| e.texture_transform.as_ref());
        let set = extension.and_then(|transform| transform.tex_coord).unwrap_or(info.tex_coord);
        if *uv_set.get_or_insert(set) != set {
            self.warn(format!(
                "{place}: its textures use different texture coordinates, the first one's are taken"
            ));
        }
        let mut transform = Affine2::IDENTITY;
        if let Some(extension) = extension {
            let (offset, scale) = (Vec2::from_array(extension.offset.0), Vec2::from_array(extension.scale.0));
            // The extension turns counter-clockwise with v pointing down.
            let rotation = Affine2::from_angle(-extension.rotation.0);
            transform = Affine2::from_translation(offset) * rotation * Affine2::from_scale(scale);
            if !transform.is_finite() {
                return Err(self.document.error(place, "its texture transform is not finite".to_owned()));
            }
        }
        let sampler = self.document.root.textures.get(info.index.value()).and_then(|t| t.sampler);
        let sampler = sampler.and_then(|sampler| self.document.root.samplers.get(sampler.value()));
        let wrap = |mode: Option<Checked<WrappingMode>>| match mode {
            Some(Checked::Valid(WrappingMode::ClampToEdge)) => Wrap::Clamp,
            Some(Checked::Valid(WrappingMode::MirroredRepeat)) => Wrap::Mirror,
            _ => Wrap::Repeat,
        };
        let wrap = [wrap(sampler.map(|s| s.wrap_s)), wrap(sampler.map(|s| s.wrap_t))];
        Ok(Some(TextureMap { texture, transform, wrap }))
    }

    /// The image of a texture; `None` with a warning where it can't be read.
    fn image(&mut self, texture: usize, place: &str) -> Result<Option<Arc<Texture>>, LoadError> {
        let document = self.document;
        let missing = || document.error(place, format!("textures[{texture}] does not exist"));
        let source = document.root.textures.get(texture).ok_or_else(missing)?.source.value();
        if let Some(known) = self.images.get(&source) {
            return Ok(known.clone());
        }
        let place = format!("images[{source}]");
        let bytes = match document.root.images.get(source) {
            None => Err(format!("textures[{texture}] has no image in a known format")),
            Some(image) => match (&image.buffer_view, &image.uri) {
                (Some(view), _) => Ok(document.view(view.value(), &place)?.0.to_vec()),
                (None, Some(uri)) => document.resource(uri, &place).map_err(|error| match error {
                    LoadError::Invalid { problem, .. } => format!("{place}: {problem}"),
                    other => other.to_string(),
                }),
                (None, None) => Err(format!("{place} names no data")),
            },
        };
        let image = bytes.and_then(|bytes| images::decode(&bytes).map_err(|why| format!("{place}: {why}")));
        let image = match image {
            Ok(image) => Some(Arc::new(image)),
            Err(problem) => {
                self.warn(format!("{problem}; the texture is left out"));
                None
            }
        };
        self.images.insert(source, image.clone());
        Ok(image)
    }

    fn warn(&mut self, message: String) {
        self.warnings.push(self.document.warning(message));
    }
}

/// How much of a reflection is a mirror's: all at roughness 0, next to nothing from one half on.
fn mirror_share(roughness: f32) -> f32 {
    (1.0 - roughness.clamp(0.0, 1.0)).powi(4)
}

/// k_d and k_s. What a rough metal reflects spreads so wide that it counts as diffuse light.
fn metallic_roughness(color: Vec3, metallic: f32, roughness: f32) -> (Vec3, Vec3) {
    let metallic = metallic.clamp(0.0, 1.0);
    let mirror = mirror_share(roughness);
    let specular = (Vec3::splat(DIELECTRIC * (1.0 - metallic)) + color * metallic) * mirror;
    let diffuse = color * ((1.0 - metallic) * (1.0 - DIELECTRIC * mirror) + metallic * (1.0 - mirror));
    (diffuse, specular)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// No surface sends back more than it receives, and the ends of the scale are what their names say.
    #[test]
    fn the_mapping_conserves_energy() {
        for i in 0..=10 {
            for j in 0..=10 {
                let (diffuse, specular) = metallic_roughness(Vec3::ONE, i as f32 / 10.0, j as f32 / 10.0);
                assert!((diffuse + specular).max_element() <= 1.0 + 1e-6);
            }
        }
        let gold = Vec3::new(1.0, 0.8, 0.3);
        assert_eq!(metallic_roughness(gold, 1.0, 0.0), (Vec3::ZERO, gold));
        assert_eq!(metallic_roughness(gold, 0.0, 1.0), (gold, Vec3::ZERO));
        assert_eq!(metallic_roughness(gold, 1.0, 1.0), (gold, Vec3::ZERO));
    }
}
