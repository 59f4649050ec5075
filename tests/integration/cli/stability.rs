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
    let rows = report["rows"].as_array().expect("rows");
    for (case, precision) in ["T15", "F03"]
        .into_iter()
        .flat_map(|case| ["robust", "reference"].map(|precision| (case, precision)))
    {
        let of = |row: &&serde_json::Value| {
            row["case"] == case
                && row["setting"]
                    .as_str()
                    .is_some_and(|s| s.starts_with(precision))
        };
        let row = rows.iter().find(of).expect("a row");
        assert!(
            row["wrong"] == 0 && row["judged"].as_u64() > Some(1000),
            "{row}"
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
