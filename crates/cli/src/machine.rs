//! Description of the machine, for reports with measured times.

use std::fs;

/// Returns the model name of the processor from `/proc/cpuinfo`; `None` on systems other than
/// Linux.
pub fn processor_name() -> Option<String> {
    let known = fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = known.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}
