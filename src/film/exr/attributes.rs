//! What a header says beside windows and channels.

/// Attributes of an image. All of them stand in every part of a file, but for some [`texts`](ExrAttributes::texts).
#[derive(Clone, Debug, PartialEq)]
pub struct ExrAttributes {
    /// `software`: the program and its version.
    pub software: String,
    /// `worldToCamera`, for row vectors: p′ = p·M, row after row. As OpenEXR defines it, camera space is left-handed, with x
    /// to the right, y up and z in the direction of view.
    pub world_to_camera: Option<[f32; 16]>,
    /// `worldToNDC`, for row vectors and followed by a division by w: x and y are (0, 0) in the upper left and (1, 1) in the
    /// lower right corner of the display window.
    pub world_to_ndc: Option<[f32; 16]>,
    /// `flatray/renderSeconds`: how long the render took. It breaks the promise of equal bytes.
    pub render_seconds: Option<f32>,
    /// Whole numbers by name.
    pub numbers: Vec<(String, i32)>,
    /// Texts by name. A text whose name begins with the same `group/` as that of a text `group/name` belongs to the part of
    /// the layer that this one names, and stands in the first part and in that one only: manifests may be large.
    pub texts: Vec<(String, String)>,
}

impl Default for ExrAttributes {
    fn default() -> ExrAttributes {
        ExrAttributes {
            software: concat!("flatray ", env!("CARGO_PKG_VERSION")).to_string(),
            world_to_camera: None,
            world_to_ndc: None,
            render_seconds: None,
            numbers: Vec::new(),
            texts: Vec::new(),
        }
    }
}

/// The attribute that is left out of what tells two renders apart.
pub(super) const RENDER_SECONDS: &str = "flatray/renderSeconds";

impl ExrAttributes {
    /// The texts of a part.
    pub(super) fn texts_of(&self, part_name: &str, is_first: bool) -> impl Iterator<Item = &(String, String)> {
        let owner = |name: &str| {
            let (group, _) = name.rsplit_once('/')?;
            let owner = self.texts.iter().find(|(name, _)| name.strip_prefix(group) == Some("/name"))?;
            Some(owner.1.as_str())
        };
        self.texts.iter().filter(move |(name, _)| is_first || owner(name).is_none_or(|owner| owner == part_name))
    }
}
