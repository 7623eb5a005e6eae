#![no_main]
wheatstone_fuzz::fuzz!("picture");
