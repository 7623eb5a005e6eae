#![no_main]
wheatstone_fuzz::fuzz!("parquet");
