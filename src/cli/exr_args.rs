//! What may be said about EXR files: `--exr` and `--crop-output`.

use clap::{Args, ValueEnum};

use crate::film::exr::{ColorType, ExrCompression, ExrLayout, ExrOptions, ExrParts};
use crate::scene::nearest::advice;

/// Options of EXR files and crops.
#[derive(Args, Clone, Debug, Default)]
pub struct ExrArgs {
    /// What EXR files are, words with commas between: half or float colour; none, rle, zips, zip or piz; scanlines or tiles;
    /// singlepart or multipart; time writes the render's seconds into the header [default: half,zip,scanlines,singlepart]
    #[arg(long, value_name = "LIST", value_parser = exr_list, help_heading = "Output")]
    pub exr: Option<ExrList>,
    /// What the files of a crop hold, of any format [default: window]
    #[arg(long, value_name = "WHAT", help_heading = "Output")]
    pub crop_output: Option<CropOutputArg>,
}

/// `--exr`
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ExrList {
    /// What a file is.
    pub options: ExrOptions,
    /// Whether its header tells how long the render took.
    pub time: bool,
}

/// `--crop-output`
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum CropOutputArg {
    /// The pixels of the crop; an EXR also says where in the whole image they lie
    #[default]
    Window,
    /// The whole image, zeros around the crop
    Full,
}

/// What a word of the list sets.
#[derive(Clone, Copy)]
enum Choice {
    Color(ColorType),
    Compression(ExrCompression),
    Layout(ExrLayout),
    Parts(ExrParts),
    Time,
}

impl Choice {
    /// The kind of the choice: of each there is one.
    fn kind(self) -> &'static str {
        match self {
            Choice::Color(_) => "the type of colour",
            Choice::Compression(_) => "compression",
            Choice::Layout(_) => "layout",
            Choice::Parts(_) => "parts",
            Choice::Time => "time",
        }
    }
}

const WORDS: [(&str, Choice); 12] = [
    ("half", Choice::Color(ColorType::Half)),
    ("float", Choice::Color(ColorType::Float)),
    ("none", Choice::Compression(ExrCompression::None)),
    ("rle", Choice::Compression(ExrCompression::Rle)),
    ("zips", Choice::Compression(ExrCompression::Zips)),
    ("zip", Choice::Compression(ExrCompression::Zip)),
    ("piz", Choice::Compression(ExrCompression::Piz)),
    ("scanlines", Choice::Layout(ExrLayout::Scanlines)),
    ("tiles", Choice::Layout(ExrLayout::Tiles)),
    ("singlepart", Choice::Parts(ExrParts::Single)),
    ("multipart", Choice::Parts(ExrParts::Multi)),
    ("time", Choice::Time),
];

/// Reads the list of `--exr`. The message completes clap's "invalid value … for …: ".
fn exr_list(text: &str) -> Result<ExrList, String> {
    let mut list = ExrList::default();
    let mut said: Vec<(&str, &str)> = Vec::new();
    for word in text.split(',').map(str::trim) {
        let Some(&(word, choice)) = WORDS.iter().find(|(known, _)| *known == word) else {
            return Err(unknown_word(word));
        };
        if let Some((before, _)) = said.iter().find(|&&(_, kind)| kind == choice.kind()) {
            return Err(match *before == word {
                true => format!("'{word}' is said twice"),
                false => format!("'{before}' and '{word}' contradict each other: both are about {}", choice.kind()),
            });
        }
        said.push((word, choice.kind()));
        match choice {
            Choice::Color(color) => list.options.color = color,
            Choice::Compression(compression) => list.options.compression = compression,
            Choice::Layout(layout) => list.options.layout = layout,
            Choice::Parts(parts) => list.options.parts = parts,
            Choice::Time => list.time = true,
        }
    }
    Ok(list)
}

fn unknown_word(word: &str) -> String {
    let lossy = ["b44", "b44a", "dwaa", "dwab", "pxr24"];
    if lossy.contains(&word.to_lowercase().as_str()) {
        return format!("'{word}' loses data and is not written: expected none, rle, zips, zip or piz");
    }
    format!("unknown word '{word}': {}", advice(word, WORDS.iter().map(|&(known, _)| known)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_sets_what_it_names_and_leaves_the_rest() {
        let list = exr_list("float, tiles,time").unwrap();
        assert_eq!((list.options.color, list.options.layout, list.time), (ColorType::Float, ExrLayout::Tiles, true));
        assert_eq!((list.options.compression, list.options.parts), (ExrCompression::Zip, ExrParts::Single));
        let list = exr_list("multipart,piz").unwrap();
        assert_eq!((list.options.compression, list.options.parts), (ExrCompression::Piz, ExrParts::Multi));
        assert_eq!(exr_list("half,zip,scanlines,singlepart"), Ok(ExrList::default()));
    }

    #[test]
    fn unknown_and_contradicting_words_are_refused() {
        let refused = |text: &str| exr_list(text).unwrap_err();
        assert_eq!(refused("flaot"), "unknown word 'flaot': did you mean 'float'?");
        assert!(refused("zip,deep").contains("expected one of half, float"));
        assert!(refused("").contains("unknown word ''"));
        assert!(refused("DWAA").contains("loses data"));
        assert!(refused("half,zip,float").contains("'half' and 'float' contradict"));
        assert!(refused("zip,zips").contains("both are about compression"));
        assert!(refused("time,time").contains("said twice"));
    }
}
