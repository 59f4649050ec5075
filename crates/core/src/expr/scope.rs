//! Variables of expressions at a hit, and the scopes that define them.

use std::ops::Range;

use raywright_bvh::scalar::{Real, Vector};

/// Variable of an expression that is evaluated at a hit. The time `t` and the scene's parameters
/// are constants, not variables.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Variable {
    /// `p`: hit point, world space, metres.
    Position,
    /// `n`: unit shading normal on the side of the incoming ray.
    Normal,
    /// `d`: unit direction of the incoming ray, towards the surface. For a sky, the direction in
    /// which the ray leaves the scene.
    Direction,
    /// `r`: `d` mirrored at the normal.
    Reflected,
    /// `l`: unit direction from the hit to the light.
    ToLight,
    /// `o`: origin of the incoming ray.
    Origin,
    /// `u`: first surface coordinate.
    U,
    /// `v`: second surface coordinate.
    V,
    /// `distance`: length of the incoming ray, metres.
    Distance,
    /// `occluder_distance`: distance in metres from the hit to the object that blocks the light;
    /// infinite if none does.
    OccluderDistance,
    /// `shadow`: fraction of the light that reaches the hit, 0 to 1, by the scene's shadow rule.
    Shadow,
}

impl Variable {
    /// Every variable.
    pub const ALL: [Self; 11] = [
        Self::Position,
        Self::Normal,
        Self::Direction,
        Self::Reflected,
        Self::ToLight,
        Self::Origin,
        Self::U,
        Self::V,
        Self::Distance,
        Self::OccluderDistance,
        Self::Shadow,
    ];

    /// Returns the name in expressions.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Position => "p",
            Self::Normal => "n",
            Self::Direction => "d",
            Self::Reflected => "r",
            Self::ToLight => "l",
            Self::Origin => "o",
            Self::U => "u",
            Self::V => "v",
            Self::Distance => "distance",
            Self::OccluderDistance => "occluder_distance",
            Self::Shadow => "shadow",
        }
    }

    /// Whether the variable is a vector; `false` for a number.
    pub const fn is_vector(self) -> bool {
        matches!(
            self,
            Self::Position
                | Self::Normal
                | Self::Direction
                | Self::Reflected
                | Self::ToLight
                | Self::Origin
        )
    }

    /// Returns the variable's bit in a mask of variables.
    pub(super) const fn bit_mask(self) -> u32 {
        1 << self as u32
    }

    /// Returns the place of the variable among the registers: the row (0 to 7), and the register in
    /// that row (0 to 3). A program loads only the rows that it reads.
    pub(super) const fn register_position(self) -> (u8, u8) {
        match self {
            Self::Position => (0, 0),
            Self::Normal => (1, 0),
            Self::Direction => (2, 0),
            Self::Reflected => (3, 0),
            Self::ToLight => (4, 0),
            Self::Origin => (5, 0),
            Self::U => (6, 0),
            Self::V => (6, 1),
            Self::Distance => (6, 2),
            Self::OccluderDistance => (6, 3),
            Self::Shadow => (7, 0),
        }
    }
}

/// The use of an expression in a scene. It determines which variables the expression may read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExprScope {
    /// A number of the scene, evaluated once while loading: no variables.
    Load,
    /// A texture or weight of a surface, evaluated at a hit.
    Surface,
    /// A weight of a single light at a hit: the variables of a surface and the variables of the
    /// light.
    Light,
    /// The colour of the sky in a direction.
    Sky,
    /// The density of a medium at a point.
    Medium,
}

impl ExprScope {
    /// Returns the variables that exist in this scope.
    pub const fn variables(self) -> &'static [Variable] {
        use Variable::{
            Direction, Distance, Normal, OccluderDistance, Origin, Position, Reflected, Shadow,
            ToLight, U, V,
        };
        match self {
            Self::Load => &[],
            Self::Surface => &[
                Position, Normal, Direction, Reflected, Origin, U, V, Distance,
            ],
            Self::Light => &[
                Position,
                Normal,
                Direction,
                Reflected,
                Origin,
                U,
                V,
                Distance,
                ToLight,
                Shadow,
                OccluderDistance,
            ],
            Self::Sky => &[Direction, Origin],
            Self::Medium => &[Position],
        }
    }

    /// Returns the place in the scene that ends the message "`d` does not exist …".
    pub(super) const fn description(self) -> &'static str {
        match self {
            Self::Load => "in a number of the scene, which is evaluated once while loading",
            Self::Surface => "on a surface",
            Self::Light => "in the weight of a light",
            Self::Sky => "in the sky",
            Self::Medium => "in the density of a medium",
        }
    }
}

/// Values of the variables at a hit. Variables outside the scope of an expression may have any
/// value. [`Default`] sets all to zero.
#[derive(Clone, Copy, Debug, Default)]
pub struct VariableValues<R: Real> {
    /// [`Variable::Position`].
    pub p: R::Vec3,
    /// [`Variable::Normal`].
    pub n: R::Vec3,
    /// [`Variable::Direction`].
    pub d: R::Vec3,
    /// [`Variable::Reflected`].
    pub r: R::Vec3,
    /// [`Variable::ToLight`].
    pub l: R::Vec3,
    /// [`Variable::Origin`].
    pub o: R::Vec3,
    /// [`Variable::U`].
    pub u: R,
    /// [`Variable::V`].
    pub v: R,
    /// [`Variable::Distance`].
    pub distance: R,
    /// [`Variable::OccluderDistance`].
    pub occluder_distance: R,
    /// [`Variable::Shadow`].
    pub shadow: R,
}

impl<R: Real> VariableValues<R> {
    /// Converts all values to `f64`.
    pub fn to_f64(&self) -> VariableValues<f64> {
        let Self {
            p,
            n,
            d,
            r,
            l,
            o,
            u,
            v,
            distance,
            occluder_distance,
            shadow,
        } = *self;
        let [p, n, d, r, l, o] = [p, n, d, r, l, o].map(Vector::to_f64);
        let [u, v, distance, occluder_distance, shadow] =
            [u, v, distance, occluder_distance, shadow].map(Real::to_f64);
        VariableValues {
            p,
            n,
            d,
            r,
            l,
            o,
            u,
            v,
            distance,
            occluder_distance,
            shadow,
        }
    }
}

// Error of an expression: message, span in the source, and hint.

/// Error of an expression. `Display` writes the message alone, because only the caller knows the
/// file and can show the span.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct ExprError {
    /// Message: one sentence without a full stop.
    pub message: String,
    /// Byte range of the source that the message refers to; both ends are character boundaries.
    pub span: Range<usize>,
    /// Hint for a correction, if any.
    pub hint: Option<String>,
}

impl ExprError {
    pub(super) fn new(message: impl Into<String>, span: Range<usize>) -> Self {
        Self {
            message: message.into(),
            span,
            hint: None,
        }
    }

    pub(super) fn with_hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }
}

pub(super) type Result<T> = core::result::Result<T, ExprError>;
