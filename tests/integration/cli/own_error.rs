//! Error estimates in picture files, and their display by `info`.

use serde_json::Value;

use super::films::{merge, render, sandbox};
use crate::support::{Sandbox, carried};

fn info(sandbox: &Sandbox, name: &str) -> Value {
    serde_json::from_str(sandbox.run(&["info", name, "--json"]).exits_with(0).text()).expect("JSON")
}

/// Rounds to three digits, as in a file.
fn shortened(value: &Value) -> f64 {
    format!("{:.2e}", value.as_f64().expect("a number"))
        .parse()
        .expect("a number")
}

/// Protects: the error in a picture's file is that of the statistics, in both formats, for the
/// denoised picture if there is one, with the sample counts and any doubt.
#[test]
fn files_say_the_error_of_the_statistics() {
    let sandbox = sandbox();
    for (words, claim, reconstruction, samples) in [
        ("--spp 64", "error", "mean", "64"),
        ("--spp 8", "error", "mean", "8"),
        ("--spp 64 --denoise", "denoised", "denoised", "64"),
    ] {
        render(
            &sandbox,
            &format!("{words} -o a.png -o a.exr --stats s.json"),
        )
        .exits_with(0);
        let stats: Value =
            serde_json::from_slice(&std::fs::read(sandbox.path("s.json")).expect("a report"))
                .expect("JSON");
        for name in ["a.png", "a.exr"] {
            let error = &info(&sandbox, name)["error"];
            for measure in ["root_relmse", "rmse"] {
                for end in ["value", "low", "high"] {
                    let (printed, known) = (&error[measure][end], &stats[claim][measure][end]);
                    assert_eq!(
                        printed.as_f64(),
                        known.as_f64().map(|_| shortened(known)),
                        "{words}, {name}: {measure} {end}"
                    );
                }
            }
            assert_eq!(
                (&error["doubt"], error["samples"].as_str()),
                (&stats[claim]["doubt"], Some(samples)),
                "{words}, {name}"
            );
            assert_eq!(error["reconstruction"], reconstruction, "{words}, {name}");
        }
    }
}

/// Protects: with adaptive sampling, the file has the least and greatest sample count; merged parts
/// have the entries of the whole; a picture without random samples and one without metadata have no
/// error; a foreign picture is shown as such.
#[test]
fn files_say_what_is_known() {
    let sandbox = sandbox();
    render(&sandbox, "--max-error 0.02 -o a.exr").exits_with(0);
    let printed = info(&sandbox, "a.exr");
    let (least, most) = printed["error"]["samples"]
        .as_str()
        .and_then(|samples| samples.split_once(".."))
        .expect("a range");
    assert!(least.parse::<u32>().expect("a number") < most.parse::<u32>().expect("a number"));
    assert!(
        printed["error"]["root_relmse"]["high"]
            .as_f64()
            .expect("an interval")
            <= 0.02,
        "{printed}"
    );
    let (value, table) = (
        &printed["error"]["root_relmse"]["value"],
        sandbox.run(&["info", "a.exr"]),
    );
    table.exits_with(0);
    assert!(
        table.text().contains(&format!("root relMSE {value} (")),
        "{}",
        table.text()
    );

    render(&sandbox, "--spp 64 -o whole.png").exits_with(0);
    for i in 1..=2 {
        render(
            &sandbox,
            &format!("--spp 64 --part {i}/2 --checkpoint {i}.film"),
        )
        .exits_with(0);
    }
    merge(&sandbox, "1.film 2.film -o joined.png").exits_with(0);
    assert_eq!(
        info(&sandbox, "joined.png")["error"],
        info(&sandbox, "whole.png")["error"]
    );

    render(&sandbox, "--spp 64 --no-metadata -o bare.png").exits_with(0);
    let bare = info(&sandbox, "bare.png");
    assert_eq!(
        (&bare["error"], &bare["size"]),
        (&Value::Null, &serde_json::json!([70, 50]))
    );
    render(
        &sandbox,
        "--spp 64 --crop 8,4,20,10 -o part.exr --aov depth",
    )
    .exits_with(0);
    let part = info(&sandbox, "part.exr");
    assert_eq!(
        part["window"],
        serde_json::json!({ "origin": [8, 4], "full": [70, 50] })
    );
    assert_eq!(part["layers"], serde_json::json!(["depth.Z"]));
    let table = sandbox.run(&["info", "part.exr"]);
    assert!(
        table
            .exits_with(0)
            .text()
            .contains("20x10 pixels at 8, 4 of 70x50"),
        "{}",
        table.text()
    );
    sandbox.write("broken.png", "no picture");
    sandbox
        .run(&["info", "broken.png"])
        .exits_with(3)
        .prints_like("broken.png: the file is not a PNG, JPEG, WebP or OpenEXR picture");
    sandbox.run(&["info", "none.exr"]).exits_with(4);
}

/// Protects: a visibly noisy picture gets one recommendation to denoise, and none if it is
/// denoised, is to keep its noise, has a target error, or is smooth. The error of few samples is
/// called a guess where it stands.
#[test]
fn denoising_is_named_where_it_helps() {
    let sandbox = sandbox();
    let said = |words: &str| {
        render(&sandbox, words)
            .exits_with(0)
            .stderr
            .contains("--denoise would reduce")
    };
    assert!(said("--spp 8 -o a.png -v"));
    for choice in ["--no-denoise", "--rung reconstruction=unbiased"] {
        assert!(!said(&format!("--spp 8 {choice} -o n.png -v")), "{choice}");
    }
    if carried("glossy-box") {
        let words = "render preset:glossy-box -s 70x50 --spp 8 --no-denoise -o g.png";
        let words: Vec<&str> = words.split(' ').collect();
        let guess = sandbox.run(&words);
        guess.prints_like(", a guess from few samples");
    }
    assert!(!said("--spp 8 --denoise -o b.png -v"));
    assert!(
        !said("--spp 4 -o c.png -v"),
        "too few to tell noise from what is seen"
    );
    assert!(!said("--max-error 0.06 -o d.png -v"));
    assert!(!said("--spp 8 --integrator whitted -o e.png -v"));
}
