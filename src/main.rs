//! The program. Its code is in `raywright_cli`, except the heap, which only a binary can choose.

/// Heap that counts the memory of the program, so that a scene does not exceed its limit.
#[global_allocator]
static HEAP: raywright_bvh::CountingHeap = raywright_bvh::CountingHeap;

fn main() -> std::process::ExitCode {
    raywright_cli::main()
}
