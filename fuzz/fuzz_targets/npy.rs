#![no_main]
wheatstone_fuzz::fuzz!("npy");
