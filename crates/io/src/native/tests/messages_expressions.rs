//! Messages about expressions, each read from a newcomer's point of view.

use super::expect_message;

/// Protects: the message for an unknown name, word for word: place, cause and remedy.
#[test]
fn an_unknown_name() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[parameters]
speed = 2
[[objects]]
material = "m"
shape.sphere = { centre = [0, "sped * t", 0], radius = 1 }
"#,
        r#"
error: unknown material `m`
 --> x.scene.toml:5:12
  |
5 | material = "m"
  |            ^^^
  |
  = help: the scene has no material

error: in the expression of `centre[1]`: unknown name `sped`
 --> x.scene.toml:6:32
  |
6 | shape.sphere = { centre = [0, "sped * t", 0], radius = 1 }
  |                                ^^^^
  |
  = help: did you mean `speed`? names that this expression may read: e, pi, tau, speed, t
"#,
    );
}

/// Protects: the message for an expression that breaks off, word for word: place, cause and remedy.
#[test]
fn an_expression_that_breaks_off() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
t = "2 *"
"#,
        r#"
error: in the expression of `t`: the expression ends where a value is expected
 --> x.scene.toml:2:9
  |
2 | t = "2 *"
  |         ^
  |
  = help: a value is a number, a name, a function call, an expression in parentheses or a vector in brackets
"#,
    );
}

/// Protects: the message for an expression without end, word for word: place, cause and remedy.
#[test]
fn an_expression_without_end() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
t = "(((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((1)))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))"
"#,
        r#"
error: in the expression of `t`: this expression is nested more than 64 levels deep; remove parentheses or divide it
 --> x.scene.toml:2:71
  |
2 | t = "(((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((1))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))))...
  |                                                                       ^
"#,
    );
}

/// Protects: the message for a division by zero, word for word: place, cause and remedy.
#[test]
fn a_division_by_zero() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[render]
exposure = "1 / t"
"#,
        r#"
error: in the expression of `exposure`: the value of this expression is inf, not a finite number
 --> x.scene.toml:3:13
  |
3 | exposure = "1 / t"
  |             ^^^^^
  |
  = help: every number of a scene must be finite
"#,
    );
}

/// Protects: the message for a parameter that uses a later one, word for word: place, cause and
/// remedy.
#[test]
fn a_parameter_that_uses_a_later_one() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[parameters]
a = "2 * b"
b = 1
"#,
        r#"
error: in the expression of `a`: unknown name `b`
 --> x.scene.toml:3:10
  |
3 | a = "2 * b"
  |          ^
  |
  = help: names that this expression may read: e, pi, tau, t
"#,
    );
}

/// Protects: the message for a parameter named like the time, word for word: place, cause and
/// remedy.
#[test]
fn a_parameter_named_like_the_time() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[parameters]
t = 1
"#,
        r#"
error: `t` cannot be the name of a parameter
 --> x.scene.toml:3:1
  |
3 | t = 1
  | ^
  |
  = help: `t` already stands for the time of the scene; choose another name
"#,
    );
}

/// Protects: the message for a number of the hit where numbers are settled, word for word: place,
/// cause and remedy.
#[test]
fn a_number_of_the_hit_where_numbers_are_settled() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[[objects]]
material = "m"
shape.sphere = { centre = [0, 0, 0], radius = "u" }
"#,
        r#"
error: unknown material `m`
 --> x.scene.toml:3:12
  |
3 | material = "m"
  |            ^^^
  |
  = help: the scene has no material

error: in the expression of `radius`: `u` does not exist in a number of the scene, which is evaluated once while loading
 --> x.scene.toml:4:48
  |
4 | shape.sphere = { centre = [0, 0, 0], radius = "u" }
  |                                                ^
  |
  = help: names that this expression may read: e, pi, tau, t
"#,
    );
}

/// Protects: the message for a vector for a weight, word for word: place, cause and remedy.
#[test]
fn a_vector_for_a_weight() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[[materials]]
name = "m"
model.classic.diffuse = "p"
"#,
        r#"
error: in the expression of `diffuse`: a weight must be a number, not a vector
 --> x.scene.toml:4:26
  |
4 | model.classic.diffuse = "p"
  |                          ^
"#,
    );
}

/// Protects: the message for a surface variable in the sky, word for word: place, cause and remedy.
#[test]
fn a_surface_variable_in_the_sky() {
    expect_message(
        "x.scene.toml",
        r#"format = 1
[sky]
expression = "mix(0.2, 1, n.y)"
"#,
        r#"
error: in the expression of `expression`: `n` does not exist in the sky
 --> x.scene.toml:3:27
  |
3 | expression = "mix(0.2, 1, n.y)"
  |                           ^
  |
  = help: names that this expression may read: d, o, e, pi, tau, t
"#,
    );
}
