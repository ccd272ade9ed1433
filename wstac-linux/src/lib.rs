//! Host side of WSTac.
