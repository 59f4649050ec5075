//! Inputs that may vary over a surface, prepared: constants stay constants, everything else is evaluated at a point.

use std::collections::BTreeMap;
use std::sync::Arc;

use raywright_bvh::{Real, Vector};

use super::PrepareError;
use super::texture::{Sampler, Textures};
use crate::expr::{Inputs, Program, Scope, Variable, compile};
use crate::scene::{ColourInput, MOST_UV_SETS, Weight};

/// What an input can depend on: the hit as expressions see it, and the texture coordinates of a mesh's further sets.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point<R: Real> {
    pub inputs: Inputs<R>,
    /// Texture coordinates of the sets from 1 on, where the material reads them; the first set's are `inputs.u` and `.v`.
    pub further_uv: [[R; 2]; MOST_UV_SETS - 1],
}

impl<R: Real> Point<R> {
    /// A hit without further sets of texture coordinates.
    #[inline(always)]
    pub fn of(inputs: Inputs<R>) -> Self {
        Self { inputs, further_uv: [[R::ZERO; 2]; MOST_UV_SETS - 1] }
    }
}

/// A scalar input.
#[derive(Clone, Debug)]
pub(crate) enum Factor<R: Real> {
    Number(R),
    Program(Arc<Program>),
}

impl<R: Real> Factor<R> {
    pub fn new(
        weight: &Weight,
        scope: Scope,
        names: &BTreeMap<String, f64>,
        path: &dyn Fn() -> String,
    ) -> Result<Self, PrepareError> {
        match weight {
            Weight::Number(v) => Ok(Self::Number(R::from_f64(*v))),
            Weight::Expression(text) => {
                let program = compile(text, names, scope).map_err(|source| PrepareError::Expression { path: path(), source })?;
                Ok(Self::Program(Arc::new(program)))
            }
        }
    }

    #[inline(always)]
    pub fn at(&self, point: &Point<R>) -> R {
        match self {
            Self::Number(v) => *v,
            Self::Program(program) => program.scalar(&point.inputs),
        }
    }

    /// Whether it depends on one of these variables.
    pub fn reads(&self, variables: &[Variable]) -> bool {
        matches!(self, Self::Program(program) if variables.iter().any(|&variable| program.uses(variable)))
    }

    /// Whether it depends on the texture coordinates.
    pub fn reads_coordinates(&self) -> bool {
        self.reads(&[Variable::U, Variable::V])
    }

    /// Zero everywhere.
    #[inline(always)]
    pub fn is_zero(&self) -> bool {
        matches!(self, Self::Number(v) if *v == R::ZERO)
    }
}

/// A colour input.
#[derive(Clone, Debug)]
pub(crate) enum ColourSource<R: Real> {
    Constant(R::Vec3),
    /// Two colours in cells of world x and z.
    Checker {
        even: R::Vec3,
        odd: R::Vec3,
        frequency: R,
    },
    Program(Arc<Program>),
    Texture(Arc<Sampler<R>>),
}

impl<R: Real> ColourSource<R> {
    pub fn new(
        input: &ColourInput,
        scope: Scope,
        names: &BTreeMap<String, f64>,
        textures: &Textures<'_>,
        path: &dyn Fn() -> String,
    ) -> Result<Self, PrepareError> {
        let v = |c: crate::scene::Colour| R::Vec3::from_f64(c.0.into());
        Ok(match input {
            ColourInput::Constant(c) => Self::Constant(v(*c)),
            ColourInput::Expression(text) => {
                let program = compile(text, names, scope).map_err(|source| PrepareError::Expression { path: path(), source })?;
                Self::Program(Arc::new(program))
            }
            ColourInput::Checker(c) => {
                Self::Checker { even: v(c.checker.even), odd: v(c.checker.odd), frequency: R::from_f64(1.0 / c.checker.size) }
            }
            ColourInput::Texture(t) => match textures.sampler(&t.texture, names, path)? {
                Some(sampler) => Self::Texture(sampler),
                None => Self::Constant(v(t.texture.factor)),
            },
        })
    }

    /// Whether it depends on the texture coordinates.
    pub fn reads_coordinates(&self) -> bool {
        match self {
            Self::Constant(_) | Self::Checker { .. } => false,
            Self::Program(program) => program.uses(Variable::U) || program.uses(Variable::V),
            Self::Texture(sampler) => sampler.reads_coordinates(),
        }
    }

    #[inline(always)]
    pub fn at(&self, point: &Point<R>) -> R::Vec3 {
        match self {
            Self::Constant(c) => *c,
            Self::Checker { even, odd, frequency } => {
                let p = point.inputs.p;
                let cell = (p.x() * *frequency).floor() + (p.z() * *frequency).floor();
                let half = cell * R::from_f64(0.5);
                if half.floor() == half { *even } else { *odd }
            }
            Self::Program(program) => program.vector(&point.inputs),
            Self::Texture(sampler) => sampler.colour(point),
        }
    }
}
