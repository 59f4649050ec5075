//! Collector of a scene's problems, with the path of the checked value.

use std::collections::{BTreeMap, HashMap};
use std::fmt::{self, Display, Write as _};

use super::{MAX_COORDINATE, MAX_PROBLEMS, MIN_LENGTH};
use crate::expr::{self, Constant, ExprError, ExprScope, Program};
use crate::fault::{Fault, FaultKind, Subject};
use crate::lookup::{NameToIndexMap, SceneLookup};
use crate::scene::{Colour, Material, Scene, Triple};
use crate::suggest::most_similar_word;

/// Greatest absolute value of a number that is no length, for example a radiance. Sums of such
/// numbers must fit the renderer's `f32`.
pub const MAX_MAGNITUDE: f64 = 1e30;

/// Greatest intensity of a light with inverse-square falloff, which fits an `f32`. At the distance
/// `MAX_COORDINATE` its irradiance is 10⁷.
pub const MAX_LIGHT_INTENSITY: f64 = 1e37;

/// Greatest number of comparisons between names for the hint "did you mean", about a second of
/// computation. Without a limit, a hundred unknown names in a large scene would take minutes.
const MAX_COMPARISONS: usize = 1_000_000;

/// Collector of a scene's problems.
pub(super) struct SceneCheck<'a> {
    /// Path of the checked value in the scene file.
    path: String,
    problems: Vec<Fault>,
    names: SceneLookup<'a>,
    /// Remaining comparisons, of [`MAX_COMPARISONS`] at first.
    comparisons: usize,
    /// Constants of expressions: the time `t` and the parameters.
    numbers: BTreeMap<String, f64>,
}

impl<'a> SceneCheck<'a> {
    /// Creates a collector without problems for a scene.
    pub fn new(scene: &'a Scene) -> Self {
        let mut numbers = scene.parameter_values();
        numbers.insert("t".to_owned(), scene.t);
        Self {
            path: String::new(),
            problems: Vec::new(),
            names: SceneLookup::new(scene),
            comparisons: MAX_COMPARISONS,
            numbers,
        }
    }

    /// Returns all problems.
    pub fn into_problems(self) -> Vec<Fault> {
        self.problems
    }

    /// Returns the number of problems so far.
    pub fn problem_count(&self) -> usize {
        self.problems.len()
    }

    /// Runs checks on the value under a key. The path of their problems is the current path
    /// followed by the key. An empty key stands for the value at the current path.
    pub fn with_key(&mut self, key: impl Display, checks: impl FnOnce(&mut Self)) {
        let before = self.path.len();
        let dot = if before == 0 { "" } else { "." };
        self.with_path_step(format_args!("{dot}{key}"), |check| {
            if check.path.len() == before + dot.len() {
                check.path.truncate(before);
            }
            checks(check);
        });
    }

    /// Runs checks while `step` is appended to the path of the checked value.
    fn with_path_step(&mut self, step: fmt::Arguments<'_>, checks: impl FnOnce(&mut Self)) {
        let length = self.path.len();
        // Writing to a String cannot fail.
        let _ = self.path.write_fmt(step);
        checks(self);
        self.path.truncate(length);
    }

    /// Runs checks on an element of an array, whose index is appended to the path.
    pub fn with_element(&mut self, index: usize, checks: impl FnOnce(&mut Self)) {
        self.with_path_step(format_args!("[{index}]"), checks);
    }

    /// Runs checks for each element of the array under a key.
    pub fn check_each_element<T>(
        &mut self,
        key: &str,
        items: &[T],
        mut checks: impl FnMut(&mut Self, &T),
    ) {
        self.with_key(key, |check| {
            for (i, item) in items.iter().enumerate() {
                check.with_element(i, |check| checks(check, item));
            }
        });
    }

    /// Reports a problem of the value under a key.
    pub fn report(&mut self, key: &str, message: impl Into<String>) {
        self.report_with_hint(key, message, "");
    }

    /// Reports a problem of the value under a key: the message is the value's name followed by
    /// `requirement`.
    fn report_value(&mut self, key: &str, requirement: impl Display) {
        self.with_key(key, |check| {
            check.report("", format!("{} {requirement}", check.current_key()))
        });
    }

    /// Reports a problem of the value under a key, with a hint.
    pub fn report_with_hint(
        &mut self,
        key: &str,
        message: impl Into<String>,
        hint: impl Into<String>,
    ) {
        self.with_key(key, |check| {
            check.push_problem(message.into(), hint.into(), None)
        });
    }

    /// Adds a problem at the current path, up to [`MAX_PROBLEMS`] problems.
    fn push_problem(
        &mut self,
        message: String,
        hint: String,
        within: Option<std::ops::Range<usize>>,
    ) {
        if self.problems.len() < MAX_PROBLEMS {
            self.problems.push(Fault {
                path: self.path.clone(),
                span: within,
                ..FaultKind::Invalid.fault(Subject::Scene, message, hint)
            });
        }
    }

    /// Returns the last key of the current path in backticks, for messages.
    fn current_key(&self) -> String {
        format!("`{}`", self.path.rsplit('.').next().unwrap_or_default())
    }

    /// Checks that the names of an array's elements are unique and, if `needed`, not empty.
    pub fn check_names<T>(
        &mut self,
        key: &str,
        items: &[T],
        name: impl Fn(&T) -> &String,
        needed: bool,
    ) {
        let mut seen: HashMap<&str, usize> = HashMap::new();
        for (i, item) in items.iter().enumerate() {
            let name = name(item).as_str();
            let problem = match seen.insert(name, i) {
                _ if name.is_empty() && needed => "`name` must not be empty".to_owned(),
                _ if name.is_empty() => continue,
                Some(first) => format!(
                    "the name `{name}` is already used by `{key}[{first}]`; rename one of the two"
                ),
                None => continue,
            };
            self.report(&format!("{key}[{i}].name"), problem);
        }
    }

    /// Returns the material with this name.
    pub fn material(&self, name: &str) -> Option<&'a Material> {
        self.names.material(name).map(|(_, material)| material)
    }

    /// Checks that the name under a key is defined. `label` is the kind of the item, such as
    /// "material".
    pub fn check_reference(
        &mut self,
        key: &str,
        name: &str,
        label: &str,
        defined: for<'n> fn(&'n SceneLookup<'a>) -> &'n NameToIndexMap<'a>,
    ) {
        let known = defined(&self.names);
        if known.index_of(name).is_some() {
            return;
        }
        let message = format!("unknown {label} `{name}`");
        let left = self.comparisons.checked_sub(known.len());
        let Some(left) = left.filter(|_| self.problems.len() < MAX_PROBLEMS) else {
            return self.report(key, message);
        };
        self.comparisons = left;
        let hint = match most_similar_word(name, known.iter()) {
            Some(word) => format!("did you mean `{word}`?"),
            None if known.len() == 0 => format!("the scene has no {label}"),
            None => {
                let list: Vec<_> = known.iter().take(20).collect();
                format!("the {label} names of this scene: {}", list.join(", "))
            }
        };
        self.report_with_hint(key, message, hint);
    }

    /// Checks an expression that yields a colour at hits: it must compile, and a constant value
    /// must have no negative channel.
    pub fn check_colour_expression(&mut self, source: &str, scope: ExprScope) {
        let program = expr::compile(source, &self.numbers, scope);
        self.check_constant_program(program);
    }

    /// Checks an expression that yields a weight at hits: it must compile to a number, and a
    /// constant value must not be negative.
    pub fn check_weight_expression(&mut self, source: &str, scope: ExprScope) {
        let program = expr::compile_number(source, &self.numbers, scope);
        self.check_constant_program(program);
    }

    /// Checks that a constant program has no negative value; reports an expression that does not
    /// compile.
    fn check_constant_program(&mut self, program: Result<Program, ExprError>) {
        match program.map(|program| program.constant_value()) {
            Ok(Some(Constant::Number(number))) => self.require_not_negative("", number),
            Ok(Some(Constant::Vector(colour))) => {
                self.require_not_negative_colour("", Colour(colour))
            }
            Ok(None) => {}
            Err(error) => self.report_expression_error(error),
        }
    }

    /// Checks an expression that yields a texture coordinate at hits: it must compile to a number,
    /// of any sign.
    pub fn check_coordinate_expression(&mut self, source: &str, scope: ExprScope) {
        if let Err(error) = expr::compile_number(source, &self.numbers, scope) {
            self.report_expression_error(error);
        }
    }

    /// Reports an expression that does not compile, at the place of its error.
    fn report_expression_error(&mut self, error: ExprError) {
        let message = format!(
            "in the expression of {}: {}",
            self.current_key(),
            error.message
        );
        self.push_problem(message, error.hint.unwrap_or_default(), Some(error.span));
    }
}

// Checks of single values: numbers, lengths, points, directions and colours.

/// Shortest direction. The squared length of a shorter direction does not fit an `f64`.
const SHORTEST_DIRECTION: f64 = 1e-100;
/// Longest direction. The squared length of a longer direction does not fit an `f64`.
const LONGEST_DIRECTION: f64 = 1e100;

impl SceneCheck<'_> {
    /// Checks a number against a range, both ends included.
    pub fn require_within(&mut self, key: &str, value: f64, minimum: f64, greatest: f64) {
        if !(minimum..=greatest).contains(&value) {
            self.report_value(
                key,
                format_args!("must be from {minimum} to {greatest}, not {value}"),
            );
        }
    }

    /// Checks a number that must be zero or within a range, both ends included.
    pub fn require_zero_or_within(&mut self, key: &str, value: f64, minimum: f64, greatest: f64) {
        if value != 0.0 && !(minimum..=greatest).contains(&value) {
            self.report_value(
                key,
                format_args!("must be 0, or from {minimum} to {greatest}, not {value}"),
            );
        }
    }

    /// Checks a number against a range, both ends excluded.
    pub fn require_between(&mut self, key: &str, value: f64, low: f64, high: f64) {
        if !(value > low && value < high) {
            self.report_value(
                key,
                format_args!("must be above {low} and below {high}, not {value}"),
            );
        }
    }

    /// Checks a whole number against a range, both ends included.
    pub fn require_count_within(&mut self, key: &str, value: u32, minimum: u32, greatest: u32) {
        self.require_within(
            key,
            f64::from(value),
            f64::from(minimum),
            f64::from(greatest),
        );
    }

    /// Checks that a number is finite and not too large.
    pub fn require_finite(&mut self, key: &str, value: f64) {
        if !value.is_finite() {
            self.report_value(key, format_args!("must be a finite number, not {value}"));
        } else if value.abs() > MAX_MAGNITUDE {
            self.report_value(
                key,
                format_args!(
                    "must be from {:e} to {MAX_MAGNITUDE:e}, not {value:e}",
                    -MAX_MAGNITUDE
                ),
            );
        }
    }

    /// Checks that a factor is not negative.
    pub fn require_not_negative(&mut self, key: &str, value: f64) {
        if value < 0.0 {
            self.report_value(key, format_args!("must not be negative, but is {value}"));
        } else {
            self.require_finite(key, value);
        }
    }

    /// Checks that a length is above zero and within the supported range.
    pub fn require_length(&mut self, key: &str, value: f64) {
        if value <= 0.0 {
            self.report_value(key, format_args!("must be above zero, not {value}"));
        } else if !(MIN_LENGTH..=MAX_COORDINATE).contains(&value) {
            self.report_value(
                key,
                format_args!("must be from {MIN_LENGTH:e} to {MAX_COORDINATE:e}, not {value:e}"),
            );
        }
    }

    /// Checks a length that may be absent.
    pub fn require_optional_length(&mut self, key: &str, value: Option<f64>) {
        if let Some(value) = value {
            self.require_length(key, value);
        }
    }

    /// Checks that a point is finite and within [`MAX_COORDINATE`] of the origin on each axis.
    pub fn require_point(&mut self, key: &str, point: Triple) {
        if point.iter().any(|x| !x.is_finite()) {
            self.report_value(
                key,
                format_args!("must be three finite numbers, not {}", format_list(&point)),
            );
        } else if point.iter().any(|x| x.abs() > MAX_COORDINATE) {
            self.report_value(
                key,
                format_args!(
                    "must lie within {MAX_COORDINATE:e} world units of the origin on each axis"
                ),
            );
        }
    }

    /// Checks that a direction is finite and has a length above zero.
    pub fn require_direction(&mut self, key: &str, direction: Triple) {
        let longest = direction
            .iter()
            .fold(0.0_f64, |longest, x| longest.max(x.abs()));
        if direction.iter().any(|x| !x.is_finite()) {
            self.report_value(
                key,
                format_args!(
                    "must be three finite numbers, not {}",
                    format_list(&direction)
                ),
            );
        } else if longest == 0.0 {
            self.report_value(key, "has length zero, so it gives no direction");
        } else if !(SHORTEST_DIRECTION..=LONGEST_DIRECTION).contains(&longest) {
            self.report_value(
                key,
                format_args!(
                    "must have a length from {SHORTEST_DIRECTION:e} to {LONGEST_DIRECTION:e}"
                ),
            );
        }
    }

    /// Checks that a colour has no negative channel and none above [`MAX_MAGNITUDE`].
    pub fn require_not_negative_colour(&mut self, key: &str, colour: Colour) {
        self.require_colour_up_to(key, colour, MAX_MAGNITUDE);
    }

    /// Checks the intensity of a light with inverse-square falloff. It may be as large as
    /// [`MAX_LIGHT_INTENSITY`], because the falloff bounds the irradiance.
    pub fn require_intensity(&mut self, key: &str, colour: Colour) {
        self.require_colour_up_to(key, colour, MAX_LIGHT_INTENSITY);
    }

    /// Checks that a colour has no negative channel and none above a limit.
    fn require_colour_up_to(&mut self, key: &str, colour: Colour, greatest: f64) {
        if colour.0.iter().any(|x| *x < 0.0) {
            self.report_value(
                key,
                format_args!(
                    "must have no negative channel, but is {}",
                    format_list(&colour.0)
                ),
            );
        } else if colour.0.iter().any(|x| !x.is_finite()) {
            self.report_value(
                key,
                format_args!("must be finite, not {}", format_list(&colour.0)),
            );
        } else if colour.0.iter().any(|x| *x > greatest) {
            self.report_value(key, format_args!("must have no channel above {greatest:e}"));
        }
    }
}

/// Formats numbers as a list such as `[1, 2, 3]`; numbers with many zeros have exponents, as in
/// `[1e-30, 1, 1]`.
pub(crate) fn format_list(values: &[f64]) -> String {
    let plain = |x: f64| x == 0.0 || !x.is_finite() || (1e-6..1e6).contains(&x.abs());
    let number = |x: &f64| {
        if plain(*x) {
            x.to_string()
        } else {
            format!("{x:e}")
        }
    };
    let values: Vec<String> = values.iter().map(number).collect();
    format!("[{}]", values.join(", "))
}
