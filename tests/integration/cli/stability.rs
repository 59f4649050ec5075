//! `stability`: measurement of the hard cases.

use crate::support::Sandbox;

/// Protects: cases are measured in both precisions, as a table, as JSON and as a page; an unknown
/// number is a usage error.
#[test]
fn cases_are_measured() {
    let sandbox = Sandbox::new();
    let run = sandbox.run(&[
        "stability",
        "--cases",
        "t15,F03,S21",
        "--json",
        "-o",
        "page.md",
    ]);
    run.exits_with(0);
    let report: serde_json::Value = serde_json::from_str(run.text()).expect("JSON");
    let cases = report["cases"].as_array().expect("cases");
    for (case, precision) in ["T15", "F03"]
        .into_iter()
        .flat_map(|case| ["robust", "reference"].map(|precision| (case, precision)))
    {
        let own = cases
            .iter()
            .find(|own| own["case"] == case)
            .expect("a case");
        let of = |result: &&serde_json::Value| {
            let setting = result["setting"].as_str();
            setting.is_some_and(|setting| setting.starts_with(precision))
        };
        let results = own["settings"].as_array().expect("settings");
        let result = results.iter().find(of).expect("a result");
        assert!(
            result["wrong"] == 0 && result["judged"].as_u64() > Some(1000),
            "{result}"
        );
    }
    assert_eq!(report["tested_only"], serde_json::json!(["S21"]));
    let page = std::fs::read_to_string(sandbox.path("page.md")).expect("a page");
    assert!(
        page.contains("| F03 |") && page.contains("S21: Phase functions"),
        "{page}"
    );
    sandbox.run(&["stability", "--cases", "T99"]).exits_with(2);
}
