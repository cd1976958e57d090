//! Textbook f64 evaluation.
