//! Limits on the size of a picture.

use crate::Limits;
use crate::import::{Fault, ImportResult};

/// Refuses a picture whose width and height, as stated in its header, exceed the limits. Called
/// before any allocation.
pub(crate) fn check_size(width: u64, height: u64, limits: &Limits) -> ImportResult<()> {
    if width == 0 || height == 0 {
        return Err(fault!("is a picture whose width or height is 0"));
    }
    if width.saturating_mul(height) > limits.image_pixels {
        return Err(Fault::over_limit(format!(
            "is a picture of {width} x {height} pixels, more than the limit of {} pixels",
            limits.image_pixels
        )));
    }
    Ok(())
}
