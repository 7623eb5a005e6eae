#![no_main]
wheatstone_fuzz::fuzz!("chart_files");
