//! The program: everything is in `raywright_cli`, but for the heap, which a program alone may
//! choose.

/// Counts what the program holds, so that no scene takes memory unasked.
#[global_allocator]
static HEAP: raywright_bvh::CountingHeap = raywright_bvh::CountingHeap;

fn main() -> std::process::ExitCode {
    raywright_cli::main()
}
