//! What the fuzz targets share: files made of the fuzzer's bytes, and a bound on single allocations.

use std::{
    alloc::{GlobalAlloc, Layout, System},
    path::{Path, PathBuf},
};
use wheatstone::{FORMATS, Format, Given, InputFile, tables};

/// Ends the program where a single allocation is larger than two gigabytes, which is what the sizes of a page in Parquet reach: no input of a fuzzer
/// needs one.
struct Bounded;

const LARGEST: usize = 1 << 31;

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

/// What stands between two files of one input.
pub const BETWEEN: &[u8] = b"\0--\0";

/// The files of an input, by these names; files beyond them are called by their number.
pub fn files(mut data: &[u8], names: &[&str]) -> Vec<InputFile> {
    let mut all = Vec::new();
    loop {
        let end = data.windows(BETWEEN.len()).position(|part| part == BETWEEN);
        let bytes = data[..end.unwrap_or(data.len())].to_vec();
        let name = names.get(all.len()).map_or_else(|| format!("file{}", all.len()), |n| (*n).into());
        all.push(InputFile { path: PathBuf::from(name), bytes });
        match end {
            Some(end) => data = &data[end + BETWEEN.len()..],
            None => return all,
        }
    }
}

/// The names that a format's files must have.
pub fn names(format: &Format) -> &'static [&'static str] {
    match format.name {
        "colmap" => &["cameras.txt", "images.txt"],
        "openptv" => &["cam1.tif.ori", "cam1.tif.addpar", "ptv.par", "cam2.tif.ori", "cam2.tif.addpar"],
        "ros" => &["left.yaml", "right.yaml"],
        _ => &[],
    }
}

/// The formats that are read, cameras or points.
pub fn formats(cameras: bool) -> Vec<&'static Format> {
    FORMATS.iter().filter(|format| format.reads() && format.is_calibration() == cameras).collect()
}

/// What files do not say of themselves.
pub fn given() -> Given {
    Given { sizes: vec![[1280, 1024]], board: Some((3, 1.0)), ..Given::default() }
}

/// Lets readers catch panics of libraries that they guard, where libFuzzer would end the program at once. A panic
/// that nobody catches still ends it.
pub fn catching() {
    std::panic::set_hook(Box::new(|_| ()));
}

/// Reads a table to its end; what is read is written and read again.
pub fn table(name: &str, data: &[u8]) {
    let options = tables::TableOptions::default();
    if let Ok(found) = tables::read_bytes(Path::new(name), data.to_vec(), &options) {
        assert!(found.correspondences.iter().all(|row| row.pixels.len() == found.cameras));
        let options = tables::TableOptions {
            duplicates: tables::Duplicates::Keep,
            ..tables::TableOptions::default()
        };
        let bytes = tables::encode(&found, Path::new("again.parquet")).expect("what is read is written");
        let again = tables::read_bytes(Path::new("again.parquet"), bytes, &options).expect("and read");
        assert_eq!(found.correspondences.len(), again.correspondences.len());
    }
}
