//! What the fuzz targets share: what each does with its bytes, which the project's own tests do too, a folder to write
//! to, and a bound on single allocations.

use std::{
    alloc::{GlobalAlloc, Layout, System},
    path::PathBuf,
    sync::OnceLock,
};

pub use libfuzzer_sys;

#[path = "../../crates/wheatstone/tests/it/formats/targets.rs"]
mod targets;

/// Ends the program where a single allocation is larger than half a gigabyte: no input of a fuzzer needs one.
struct Bounded;

const LARGEST: usize = 1 << 29;

#[global_allocator]
static ALLOCATOR: Bounded = Bounded;

fn bound(size: usize) {
    if size > LARGEST {
        // No message: making one would allocate.
        std::process::abort();
    }
}

// SAFETY: all is handed to the system's allocator as it came.
unsafe impl GlobalAlloc for Bounded {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        bound(layout.size());
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        bound(layout.size());
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, place: *mut u8, layout: Layout) {
        unsafe { System.dealloc(place, layout) }
    }

    unsafe fn realloc(&self, place: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        bound(size);
        unsafe { System.realloc(place, layout, size) }
    }
}

/// A folder of this process.
fn folder() -> &'static PathBuf {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| tempfile::tempdir().expect("a temporary folder").keep())
}

/// Lets readers catch panics of libraries that they guard, where libFuzzer would end the program at once. A panic
/// that nobody catches still ends it.
pub fn catching() {
    std::panic::set_hook(Box::new(|_| ()));
}

/// Runs the target of this name.
pub fn run(name: &str, data: &[u8]) {
    let (_, target) = targets::TARGETS.iter().find(|target| target.0 == name).expect("it is one");
    target(data, folder());
}

/// The entry of a fuzz target.
#[macro_export]
macro_rules! fuzz {
    ($name:literal) => {
        $crate::libfuzzer_sys::fuzz_target!(init: $crate::catching(), |data: &[u8]| $crate::run($name, data));
    };
}
