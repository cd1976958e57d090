//! ref
/// k
#[derive(Clone,Copy,Debug,PartialEq)]
pub enum Kind {
    /// a
    Slerp, 
    /// a
    CatmullRom,
    /// a
    BesselOverhauser,
    /// a
    BSpline }
