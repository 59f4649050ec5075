//! Which part of a surface's answer a light asks for, and whether it is weighed against what the surface would have drawn.

/// What a light asks of a surface.
#[derive(Clone, Copy, Debug)]
pub(super) enum MisStrategy {
    /// What it sends back.
    Value,
    /// The same of a light without size, of which only some make highlights.
    Delta { shines: bool },
    /// What it sends back, and how densely it would have drawn a direction that the light drew with this density.
    Weighed(f64),
}

impl MisStrategy {
    /// Whether what is diffused alone answers it.
    pub fn is_dull(&self) -> bool {
        matches!(self, Self::Delta { shines: false })
    }
}
