//! The machine code of SIMD tasks. A function that the compiler does not inline into a task is
//! compiled for the baseline processor: the task's registers then go through memory, and its gain
//! is lost without any other sign.

use std::collections::BTreeMap;
use std::process::Command;

/// Parts of the names of functions that tasks may call.
const ALLOWED: [&str; 12] = [
    // Failed checks of indices and overflows end the program.
    "core::panicking::",
    "core::slice::index::",
    // Whole arrays, cleared or copied at the ends of a task.
    "memcpy",
    "memset",
    // Angles near an axis, which are rare; tables, which are built once.
    "libm::math::sincos::sincos",
    "std::sys::sync::once::",
    // The denoiser's tasks allocate, once for many pixels.
    "alloc::",
    "__rustc::__rust_",
    "core::array::<impl [T; N]>::try_map",
    "_Unwind_Resume",
    // Lobes that rough opaque surfaces do not have: the calls are never reached.
    "Dielectric<N> as raywright_core::material::lobe_traits::ScatteringLobe<N>>::sample_delta",
    "MultipleScattering<N> as raywright_core::material::lobe_traits::ScatteringLobe<N>>::",
];

/// Machine code of a program, as objdump prints it.
struct MachineCode {
    disassembly: String,
    /// Relocations: each is the address of a slot, and the address or the name that it holds.
    relocations: String,
}

impl MachineCode {
    /// Reads the code of a program; `None` without objdump.
    fn read(program: &str) -> Option<Self> {
        let run = |arguments: &[&str]| {
            let output = Command::new("objdump")
                .args(arguments)
                .arg(program)
                .output();
            Some(String::from_utf8_lossy(&output.ok()?.stdout).into_owned())
        };
        Some(Self {
            disassembly: run(&["-d", "-C", "--no-show-raw-insn"])?,
            relocations: run(&["-R", "-C"])?,
        })
    }

    /// Returns the functions by their addresses.
    fn functions(&self) -> BTreeMap<u64, &str> {
        self.disassembly.lines().filter_map(header).collect()
    }

    /// Returns the names of the functions that tasks call, with their numbers of calls, and the
    /// number of tasks. Calls through registers have no name.
    fn calls_of_tasks(&self) -> (BTreeMap<&str, usize>, usize) {
        let functions = self.functions();
        let slots: BTreeMap<u64, &str> = self
            .relocations
            .lines()
            .filter_map(|line| {
                let mut words = line.splitn(3, ' ');
                let slot = u64::from_str_radix(words.next()?, 16).ok()?;
                let target = words.nth(1)?.trim();
                let name = target
                    .strip_prefix("*ABS*+0x")
                    .map_or(Some(target), |address| {
                        let address = u64::from_str_radix(address, 16).ok()?;
                        functions.get(&address).copied()
                    });
                Some((slot, name?))
            })
            .collect();
        let (mut calls, mut tasks, mut is_task) = (BTreeMap::new(), 0, false);
        for line in self.disassembly.lines() {
            if let Some((_, name)) = header(line) {
                is_task = name.ends_with("run_with_avx512") || name.ends_with("run_with_avx2");
                tasks += usize::from(is_task);
            } else if is_task && let Some((_, called)) = line.split_once("call ") {
                let name = match called.split_once("# ") {
                    Some((_, slot)) => slot
                        .split_once(' ')
                        .and_then(|(slot, _)| u64::from_str_radix(slot, 16).ok())
                        .and_then(|slot| slots.get(&slot).copied()),
                    None => called
                        .split_once('<')
                        .map(|(_, name)| name.trim_end_matches('>')),
                };
                if let Some(name) = name {
                    *calls.entry(name).or_insert(0) += 1;
                }
            }
        }
        (calls, tasks)
    }
}

/// Returns address and name of a function at its first line.
fn header(line: &str) -> Option<(u64, &str)> {
    let (address, name) = line.strip_suffix(">:")?.split_once(" <")?;
    Some((u64::from_str_radix(address, 16).ok()?, name))
}

/// Protects: SIMD tasks call nothing that is compiled for the baseline processor, so that their
/// values stay in wide registers. Only a release build inlines as the shipped program does: the
/// variable `RELEASE_BUILD` names one, unless this test is part of one.
#[test]
fn simd_tasks_call_nothing_of_the_baseline() {
    let named = std::env::var("RELEASE_BUILD");
    let program = match &named {
        Ok(program) => program.as_str(),
        Err(_) if cfg!(debug_assertions) => {
            eprintln!("skipped: `RELEASE_BUILD` names no program");
            return;
        }
        Err(_) => env!("CARGO_BIN_EXE_raywright"),
    };
    if !cfg!(target_arch = "x86_64") {
        eprintln!("skipped: not x86-64");
        return;
    }
    let Some(code) = MachineCode::read(program) else {
        eprintln!("skipped: no objdump");
        return;
    };
    let (mut calls, tasks) = code.calls_of_tasks();
    assert!(
        tasks > 20,
        "only {tasks} tasks: are they inlined, or renamed?"
    );
    calls.retain(|name, _| !ALLOWED.iter().any(|allowed| name.contains(allowed)));
    assert!(
        calls.is_empty(),
        "not inlined into a SIMD task: {calls:#?}\nWrite a loop or a function in place of a closure, mark the function `#[inline(always)]`, or list it in `ALLOWED` with a reason."
    );
}
