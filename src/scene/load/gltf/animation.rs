//! Animations: how nodes move.

use std::collections::HashMap;

use glam::{DVec3, DVec4};
use gltf_json::animation::{Animation, Interpolation as Mode, Property};
use gltf_json::validation::Checked;

use super::document::Document;
use super::nodes::{PlacedNode, local};
use crate::scene::animation::{Channels, Curve, CurveError, Interpolation, Local, Node, Rig, Turning, Value};
use crate::scene::load::LoadError;

/// Times and values of all channels together: accessors may be shared, and need not cost the file anything.
const MOST_VALUES: u64 = 1 << 23;

impl Document<'_> {
    /// The nodes of the scene with all animations of the file, which play together: of several that move one property of a node the first one
    /// counts. Empty for a file without animations.
    ///
    /// # Errors
    /// [`LoadError::Invalid`] for channels whose parts don't exist, or are no keyframes.
    pub fn rig(&self, placed: &[PlacedNode]) -> Result<Rig, LoadError> {
        let mut rig = Rig::default();
        if self.root.animations.is_empty() {
            return Ok(rig);
        }
        let mut channels: HashMap<usize, Channels> = HashMap::new();
        let mut left = MOST_VALUES;
        for (number, animation) in self.root.animations.iter().enumerate() {
            for channel in 0..animation.channels.len() {
                let place = format!("animations[{number}].channels[{channel}]");
                if self.channel(animation, channel, &place, &mut channels, &mut left)? {
                    let note = format!("{}: morph targets don't move", self.path.display());
                    rig.notes = vec![note];
                }
            }
        }
        rig.nodes = placed
            .iter()
            .filter_map(|placed| {
                let channels = channels.remove(&placed.index).unwrap_or_default();
                let rest = match local(self.root.nodes.get(placed.index)?) {
                    // Against the rules, but clear.
                    Local::Matrix(matrix) if !channels.is_empty() => {
                        let (scale, rotation, translation) = matrix.to_scale_rotation_translation();
                        Local::Steps { translation, rotation, scale }
                    }
                    rest => rest,
                };
                Some(Node { parent: placed.parent.map(|parent| parent as u32), rest, channels })
            })
            .collect();
        Ok(rig)
    }

    /// Adds a channel to those of its node; whether it moves morph targets instead.
    fn channel(
        &self,
        animation: &Animation,
        channel: usize,
        place: &str,
        channels: &mut HashMap<usize, Channels>,
        left: &mut u64,
    ) -> Result<bool, LoadError> {
        let Some(channel) = animation.channels.get(channel) else { return Ok(false) };
        let sampler = channel.sampler.value();
        let Some(sampler) = animation.samplers.get(sampler) else {
            return Err(self.error(place, format!("samplers[{sampler}] does not exist")));
        };
        let node_index = channel.target.node.value();
        if node_index >= self.root.nodes.len() {
            return Err(self.error(place, format!("nodes[{node_index}] does not exist")));
        }
        let path = match channel.target.path {
            Checked::Valid(Property::MorphTargetWeights) => return Ok(true),
            Checked::Valid(path) => path,
            // Extensions animate other properties.
            Checked::Invalid => return Ok(false),
        };
        let Checked::Valid(mode) = sampler.interpolation else {
            return Err(self.error(place, "its interpolation is unknown".to_owned()));
        };
        for accessor in [sampler.input, sampler.output] {
            let values = self.accessor_len(accessor.value(), place)?;
            *left = left.checked_sub(values).ok_or_else(|| {
                self.error(place, format!("the animations of a file have at most {MOST_VALUES} values"))
            })?;
        }
        let times = self.floats::<1>(sampler.input.value(), place)?;
        let times: Vec<f64> = times.into_iter().map(|[time]| f64::from(time)).collect();
        let output = sampler.output.value();
        let own = channels.entry(node_index).or_default();
        match path {
            Property::Rotation => {
                let values = self.values::<4>(output, place)?;
                let curve =
                    self.curve(times, values.into_iter().map(DVec4::from_array).collect(), mode, place)?;
                own.rotation.get_or_insert(Turning::Quaternions(curve));
            }
            _ => {
                let values = self.values::<3>(output, place)?;
                let curve =
                    self.curve(times, values.into_iter().map(DVec3::from_array).collect(), mode, place)?;
                let step = if path == Property::Scale { &mut own.scale } else { &mut own.translation };
                step.get_or_insert(curve);
            }
        }
        Ok(false)
    }

    fn values<const N: usize>(&self, accessor: usize, place: &str) -> Result<Vec<[f64; N]>, LoadError> {
        let values = self.floats::<N>(accessor, place)?;
        if values.iter().flatten().any(|value| !value.is_finite()) {
            return Err(self.error(place, "a value is not finite".to_owned()));
        }
        Ok(values.into_iter().map(|value| value.map(f64::from)).collect())
    }

    fn curve<V: Value>(
        &self,
        times: Vec<f64>,
        values: Vec<V>,
        mode: Mode,
        place: &str,
    ) -> Result<Curve<V>, LoadError> {
        let curve = match mode {
            Mode::Step => Curve::new(times, values, Interpolation::Step),
            Mode::Linear => Curve::new(times, values, Interpolation::Linear),
            Mode::CubicSpline => Curve::cubic(times, &values),
        };
        curve.map_err(|error: CurveError| self.error(place, error.to_string()))
    }
}
