// Written by ci/generated protobuf, from tests/protobuf/proto.

/// A picture as a camera gives it.
#[derive(Clone, PartialEq, Eq, Hash, ::prost::Message)]
pub struct RawImage {
    /// When it was taken.
    #[prost(message, optional, tag = "1")]
    pub timestamp: ::core::option::Option<::prost_types::Timestamp>,
    /// Where it was taken.
    #[prost(string, tag = "7")]
    pub frame_id: ::prost::alloc::string::String,
    /// Width in pixels.
    #[prost(fixed32, tag = "2")]
    pub width: u32,
    /// Height in pixels.
    #[prost(fixed32, tag = "3")]
    pub height: u32,
    /// Pixel format.
    #[prost(string, tag = "4")]
    pub encoding: ::prost::alloc::string::String,
    /// Bytes from row to row.
    #[prost(fixed32, tag = "5")]
    pub step: u32,
    /// Bytes of the pixels.
    #[prost(bytes = "vec", tag = "6")]
    pub data: ::prost::alloc::vec::Vec<u8>,
}
/// A compressed picture.
#[derive(Clone, PartialEq, Eq, Hash, ::prost::Message)]
pub struct CompressedImage {
    /// When it was taken.
    #[prost(message, optional, tag = "1")]
    pub timestamp: ::core::option::Option<::prost_types::Timestamp>,
    /// Where it was taken.
    #[prost(string, tag = "4")]
    pub frame_id: ::prost::alloc::string::String,
    /// Bytes of the picture's file.
    #[prost(bytes = "vec", tag = "2")]
    pub data: ::prost::alloc::vec::Vec<u8>,
    /// Kind of the picture's file.
    #[prost(string, tag = "3")]
    pub format: ::prost::alloc::string::String,
}
/// A line of a log.
#[derive(Clone, PartialEq, Eq, Hash, ::prost::Message)]
pub struct Log {
    /// When it was written.
    #[prost(message, optional, tag = "1")]
    pub timestamp: ::core::option::Option<::prost_types::Timestamp>,
    /// How much it matters.
    #[prost(enumeration = "log::Level", tag = "2")]
    pub level: i32,
    /// The line.
    #[prost(string, tag = "3")]
    pub message: ::prost::alloc::string::String,
    /// The program that wrote it.
    #[prost(string, tag = "4")]
    pub name: ::prost::alloc::string::String,
    /// The source file that wrote it.
    #[prost(string, tag = "5")]
    pub file: ::prost::alloc::string::String,
    /// The line of that source file.
    #[prost(fixed32, tag = "6")]
    pub line: u32,
}
/// Nested message and enum types in `Log`.
pub mod log {
    /// How much a line matters.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, ::prost::Enumeration)]
    #[repr(i32)]
    pub enum Level {
        Unknown = 0,
        Debug = 1,
        Info = 2,
        Warning = 3,
        Error = 4,
        Fatal = 5,
    }
    impl Level {
        /// String value of the enum field names used in the ProtoBuf definition.
        ///
        /// The values are not transformed in any way and thus are considered stable
        /// (if the ProtoBuf definition does not change) and safe for programmatic use.
        pub fn as_str_name(&self) -> &'static str {
            match self {
                Self::Unknown => "UNKNOWN",
                Self::Debug => "DEBUG",
                Self::Info => "INFO",
                Self::Warning => "WARNING",
                Self::Error => "ERROR",
                Self::Fatal => "FATAL",
            }
        }
        /// Creates an enum from field names used in the ProtoBuf definition.
        pub fn from_str_name(value: &str) -> ::core::option::Option<Self> {
            match value {
                "UNKNOWN" => Some(Self::Unknown),
                "DEBUG" => Some(Self::Debug),
                "INFO" => Some(Self::Info),
                "WARNING" => Some(Self::Warning),
                "ERROR" => Some(Self::Error),
                "FATAL" => Some(Self::Fatal),
                _ => None,
            }
        }
    }
}
