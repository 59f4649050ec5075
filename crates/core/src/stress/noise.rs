//! Plain noise: the expected error of a picture with the scene's own number of samples.

use super::facts::SceneFacts;
use super::finding::{FindingCode, Severity, StressFinding};
use super::numbers::format_rounded_up;
use super::small_render::{SmallRender, camera_subject};
use crate::metrics::RELATIVE_FLOOR;
use crate::settings::Settings;

/// Least reported error (root relMSE).
const NOISY: f64 = 0.4;
/// Error for which a remedy gives the number of samples.
const AIM: f64 = 0.1;

/// Returns the advice to take more samples, given the error with `samples` per pixel.
pub(super) fn more_samples_remedy(error: f64, samples: u32) -> String {
    let enough = f64::from(samples.max(1)) * (error / AIM).max(1.0).powi(2);
    let enough = format_rounded_up(enough.max(1.0));
    format!("render with more --spp (about {enough} for an error of {AIM})")
}

/// Returns a noise as `render` measures errors: as a share of the radiance, but of a dark surface
/// not as more than ten times the radiance.
pub(super) fn relative_error(noise: f64, mean_radiance: f64) -> f64 {
    noise / (mean_radiance * mean_radiance + RELATIVE_FLOOR).sqrt()
}

/// Returns a finding about the camera with the noisiest picture, unless the settings end or hide
/// noise themselves.
pub(super) fn check_noise(
    scene_facts: &SceneFacts<'_>,
    pictures: &[SmallRender],
    settings: &Settings,
) -> Option<StressFinding> {
    let samples = settings.sampling.samples_per_pixel();
    let error = |picture| Some((picture, SmallRender::expected_error(picture, samples)?));
    let (picture, error) = pictures
        .iter()
        .filter(|picture| picture.is_noise_spread())
        .filter_map(error)
        .max_by(|a, b| a.1.total_cmp(&b.1))?;
    if error < NOISY || settings.max_error.is_some() || settings.denoise {
        return None;
    }
    let reason = format!(
        "{samples} samples per pixel leave much noise: the expected error, which `render` prints, is {error:.2} (root relMSE)"
    );
    let remedy = format!(
        "{}, with --max-error {AIM} or with --denoise; larger lamps and openings need fewer samples",
        more_samples_remedy(error, samples)
    );
    let subject = camera_subject(scene_facts, picture);
    let (code, severity) = (FindingCode::NoisyPicture, Severity::SlowOrNoisy);
    Some(StressFinding::new(code, severity, subject, reason, remedy))
}
