//! How an extension point lists its implementations.

/// Declares an enum with one variant per implementation of a trait.
///
/// The enum reads and writes `{"type": "<name>", …fields}`, dereferences to the trait object, and
/// lists its names in `NAMES`. With `, all` after the trait it also builds one default of each,
/// which is what the contract tests and the `list` command go through.
#[macro_export]
macro_rules! registry {
    ($(#[$doc:meta])* pub enum $any:ident: $trait:ident, all { $($rows:tt)+ }) => {
        $crate::registry! { $(#[$doc])* pub enum $any: $trait { $($rows)+ } }
        $crate::registry! { @all $any $($rows)+ }
    };
    ($(#[$doc:meta])* pub enum $any:ident: $trait:ident {
        $($name:literal => $variant:ident($type:ty)),+ $(,)?
    }) => {
        $(#[$doc])*
        #[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(tag = "type")]
        #[allow(
            clippy::large_enum_variant,
            reason = "there are a handful of these at a time, and boxes would show in every match"
        )]
        #[non_exhaustive]
        pub enum $any {
            $(#[doc = concat!("`", $name, "`")] #[serde(rename = $name)] $variant($type)),+
        }

        impl $any {
            /// The name of every implementation, as configuration files spell it.
            pub const NAMES: &'static [&'static str] = &[$($name),+];
        }

        impl std::ops::Deref for $any {
            type Target = dyn $trait;
            fn deref(&self) -> &Self::Target {
                match self { $(Self::$variant(it) => it),+ }
            }
        }

        impl std::ops::DerefMut for $any {
            fn deref_mut(&mut self) -> &mut Self::Target {
                match self { $(Self::$variant(it) => it),+ }
            }
        }

        $(impl From<$type> for $any {
            fn from(it: $type) -> Self { Self::$variant(it) }
        })+
    };
    (@all $any:ident $($name:literal => $variant:ident($type:ty)),+ $(,)?) => {
        impl $any {
            /// One default of every implementation.
            pub fn all() -> Vec<Self> {
                vec![$(<$type>::default().into()),+]
            }
        }
    };
}
