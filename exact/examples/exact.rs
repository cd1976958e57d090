//! Makes a compiled shader exact: `cargo run -p tumble-exact --example exact -- shader.spv exact.spv`.
//!
//! If the shader has operations that Vulkan does not define to the last bit, they are listed with their lines, and nothing
//! is written.

use std::error::Error;
use std::{env, fs};

use tumble_exact::{exact, inexact, splat_products};

fn main() -> Result<(), Box<dyn Error>> {
    let paths: Vec<String> = env::args().skip(1).collect();
    let [input, output] = paths.as_slice() else {
        return Err(
            "two files are needed: the shader that is read, and the one that is written".into(),
        );
    };
    let bytes = fs::read(input).map_err(|error| format!("{input}: {error}"))?;
    let (words, rest) = bytes.as_chunks();
    if !rest.is_empty() {
        return Err(format!("{input}: {} bytes are not whole words", bytes.len()).into());
    }
    let words: Vec<u32> = words.iter().map(|&word| u32::from_le_bytes(word)).collect();
    let found = inexact(&splat_products(&words)?)?;
    if !found.is_empty() {
        let list: Vec<String> = found.iter().map(|one| format!("{input}: {one}")).collect();
        return Err(list.join("\n").into());
    }
    let bytes: Vec<u8> = (exact(&words)?.iter())
        .flat_map(|word| word.to_le_bytes())
        .collect();
    fs::write(output, bytes).map_err(|error| format!("{output}: {error}"))?;
    Ok(())
}
