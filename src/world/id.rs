//! Typed row numbers: a material cannot be looked up with a mesh's number.

macro_rules! ids {
    ($($(#[$doc:meta])* $name:ident)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(transparent)]
        pub struct $name(pub u32);

        impl $name {
            /// The row as an index into a column.
            #[inline]
            pub fn idx(self) -> usize {
                self.0 as usize
            }
        }
    )*};
}

ids! {
    /// A row of [`Materials`](super::Materials).
    MaterialId
    /// A row of [`Meshes`](super::Meshes).
    MeshId
    /// An object of the scene file, numbered in the order of the file. Names live outside the world.
    ObjectId
    /// A group of lights, numbered from 0; light without a group of its own is in one like any other.
    LightGroupId
}
