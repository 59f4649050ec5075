//! The program. Everything is in `raywright_cli`, except the heap, which only a program can choose.

/// Counts the memory of the program, so that no scene exceeds its limit.
#[global_allocator]
static HEAP: raywright_bvh::CountingHeap = raywright_bvh::CountingHeap;

fn main() -> std::process::ExitCode {
    raywright_cli::main()
}
