//! The machine and the peak memory of the process, as the operating system describes them.

use std::fs;

/// Returns the model name of the processor from `/proc/cpuinfo`; `None` on systems other than
/// Linux.
pub fn processor_name() -> Option<String> {
    let known = fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = known.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

/// Returns the peak resident memory of the process in bytes; `None` on systems without `/proc`.
pub fn peak_memory_bytes() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024)
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    /// Protects: touched memory counts towards the peak.
    #[test]
    fn touched_memory_is_counted() {
        let block = vec![1_u8; 32 << 20];
        let peak = super::peak_memory_bytes().expect("Linux says it");
        assert!(
            peak > block.iter().map(|&byte| u64::from(byte)).sum(),
            "{peak}"
        );
    }
}
