//! What a reader of measured times needs to know of the machine.

use std::fs;

/// What Linux calls the processor.
pub fn processor() -> Option<String> {
    let known = fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = known.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}
