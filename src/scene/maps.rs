//! Depth and normal maps of a view, and the status of each pixel.

/// Depth and normal of every pixel of a view, row by row.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Maps {
    /// Depth in world units, 0 where there is none.
    pub depth: Vec<f32>,
    /// Unit normal in the view's camera frame, facing the camera; zeros where there is no depth.
    pub normal: Vec<[f32; 3]>,
}

/// Status of a pixel: validated, or the reason why it is not.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum PixelStatus {
    /// The plane is consistent with enough source views.
    Validated,
    /// The mask excludes the pixel.
    Masked,
    /// The variance in the window around the pixel is too small for matching.
    NoTexture,
    /// There is no plane, or it is visible in fewer source views than matching needs: two, or one with
    /// `check.min_consistent_views` = 1.
    NoSources,
    /// Too few source views are consistent with the plane.
    Inconsistent,
    /// The depth is at an end of the depth range: the surface may lie outside of it.
    OutOfRange,
}

impl PixelStatus {
    /// All values, in the order of their discriminants.
    pub const ALL: [PixelStatus; 6] = [
        PixelStatus::Validated,
        PixelStatus::Masked,
        PixelStatus::NoTexture,
        PixelStatus::NoSources,
        PixelStatus::Inconsistent,
        PixelStatus::OutOfRange,
    ];

    /// Its name in reports.
    pub fn name(self) -> &'static str {
        match self {
            PixelStatus::Validated => "validated",
            PixelStatus::Masked => "masked",
            PixelStatus::NoTexture => "no_texture",
            PixelStatus::NoSources => "no_sources",
            PixelStatus::Inconsistent => "inconsistent",
            PixelStatus::OutOfRange => "out_of_range",
        }
    }
}
