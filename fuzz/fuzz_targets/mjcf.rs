#![no_main]
libfuzzer_sys::fuzz_target!(|data: &[u8]| tumble_fuzz::target("mjcf", data));
