//! What an EXR file may be. Everything here is lossless but for the choice of 16 bits for colour.

/// How an EXR file is made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ExrOptions {
    /// What planes of colour are kept in; all others keep their 32 bits.
    pub color: ColorType,
    /// How blocks are compressed.
    pub compression: ExrCompression,
    /// What blocks are.
    pub layout: ExrLayout,
    /// How many parts a file has.
    pub parts: ExrParts,
}

impl ExrOptions {
    /// The defaults, with colour in 32 bits: what is read back is what the film held.
    pub const FLOAT: ExrOptions = ExrOptions {
        color: ColorType::Float,
        compression: ExrCompression::Zip,
        layout: ExrLayout::Scanlines,
        parts: ExrParts::Single,
    };
}

/// The sample type of colour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ColorType {
    /// 16 bits, rounded to the nearest, ties to even. Finite values beyond the range become the largest finite one, 65504.
    #[default]
    Half,
    /// 32 bits.
    Float,
}

/// The lossless methods of compression. The lossy ones damage depth, positions and Cryptomatte, and are not written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ExrCompression {
    /// None, line by line.
    None,
    /// Runs of bytes, line by line.
    Rle,
    /// Deflate, line by line.
    Zips,
    /// Deflate, 16 lines at a time.
    #[default]
    Zip,
    /// Wavelets and Huffman codes, 32 lines at a time.
    Piz,
}

/// What the pixels of a part are cut into.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ExrLayout {
    /// Whole lines, as many as the compression takes at a time.
    #[default]
    Scanlines,
    /// Squares of 64 pixels, in one resolution.
    Tiles,
}

/// How planes are distributed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ExrParts {
    /// All in one part.
    #[default]
    Single,
    /// One part for each layer: `R`, `G`, `B` and `A` make the part `rgba`, `diffuse.R` and its like `diffuse`, the ranks of a
    /// Cryptomatte one part. Channels keep their full names, and all parts have the same data window.
    Multi,
}
