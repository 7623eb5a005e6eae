#![no_main]
wheatstone_fuzz::fuzz!("calibrations");
