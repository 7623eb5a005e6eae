//! How an extension point lists its implementations, and takes those of other crates.

use serde::{Serialize, Serializer, ser::Error as _};
use std::{fmt, sync::Arc};

/// An implementation of a trait from outside of this library, under a name of its own: the variant
/// `Custom` of `AnyMethod`, `AnyReconstructor`, `AnyCamera` and `AnyChart`.
///
/// It cannot be written to a file, because nothing could read it back. Two of them are equal where one
/// is a clone of the other and neither was changed since.
pub struct Custom<T: ?Sized> {
    name: String,
    held: Box<dyn Held<T>>,
    identity: Arc<()>,
}

impl<T: ?Sized> Custom<T> {
    /// Of an implementation that is held.
    #[doc(hidden)]
    #[must_use]
    pub fn new(name: String, held: Box<dyn Held<T>>) -> Self {
        Self { name, held, identity: Arc::new(()) }
    }

    /// The name that it was given.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The implementation.
    #[must_use]
    pub fn get(&self) -> &T {
        self.held.get()
    }

    /// The implementation, to be changed.
    pub fn get_mut(&mut self) -> &mut T {
        self.identity = Arc::new(());
        self.held.get_mut()
    }
}

impl<T: ?Sized> Clone for Custom<T> {
    fn clone(&self) -> Self {
        Self { name: self.name.clone(), held: self.held.copied(), identity: self.identity.clone() }
    }
}

impl<T: ?Sized> PartialEq for Custom<T> {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name && Arc::ptr_eq(&self.identity, &other.identity)
    }
}

impl<T: ?Sized> fmt::Debug for Custom<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Custom").field("name", &self.name).finish_non_exhaustive()
    }
}

impl<T: ?Sized> Serialize for Custom<T> {
    fn serialize<S: Serializer>(&self, _: S) -> Result<S::Ok, S::Error> {
        Err(S::Error::custom(format!(
            "`{}` is not part of this library: it cannot be saved",
            self.name
        )))
    }
}

/// A value that can be copied and seen as an implementation of a trait. [`registry!`](crate::registry!)
/// implements it.
#[doc(hidden)]
pub trait Held<T: ?Sized>: Send + Sync {
    /// Another one like it.
    fn copied(&self) -> Box<dyn Held<T>>;
    /// The implementation.
    fn get(&self) -> &T;
    /// The implementation, to be changed.
    fn get_mut(&mut self) -> &mut T;
}

/// A value of another crate.
#[doc(hidden)]
pub struct Holder<C>(pub C);

/// Declares an enum with one variant per implementation of a trait, and one for those of other crates.
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
            $(#[doc = concat!("`", $name, "`")] #[serde(rename = $name)] $variant($type),)+
            /// One from outside of this library; it cannot be saved.
            #[serde(skip_deserializing)]
            Custom($crate::registry::Custom<dyn $trait>),
        }

        impl $any {
            /// The name of every implementation of this library, as configuration files spell it.
            pub const NAMES: &'static [&'static str] = &[$($name),+];

            /// Its name in files and on the command line; of one from outside of this library, the name that
            /// it was given.
            #[must_use]
            pub fn kind(&self) -> &str {
                match self { $(Self::$variant(_) => $name,)+ Self::Custom(it) => it.name() }
            }

            /// One from outside of this library, under a name of its own.
            pub fn custom<C>(name: impl Into<String>, it: C) -> Self
            where
                C: $trait + Clone + Send + Sync + 'static,
            {
                let held = Box::new($crate::registry::Holder(it));
                Self::Custom($crate::registry::Custom::new(name.into(), held))
            }
        }

        impl<C> $crate::registry::Held<dyn $trait> for $crate::registry::Holder<C>
        where
            C: $trait + Clone + Send + Sync + 'static,
        {
            fn copied(&self) -> Box<dyn $crate::registry::Held<dyn $trait>> {
                Box::new($crate::registry::Holder(self.0.clone()))
            }
            fn get(&self) -> &(dyn $trait + 'static) {
                &self.0
            }
            fn get_mut(&mut self) -> &mut (dyn $trait + 'static) {
                &mut self.0
            }
        }

        impl std::ops::Deref for $any {
            type Target = dyn $trait;
            fn deref(&self) -> &Self::Target {
                match self { $(Self::$variant(it) => it,)+ Self::Custom(it) => it.get() }
            }
        }

        impl std::ops::DerefMut for $any {
            fn deref_mut(&mut self) -> &mut Self::Target {
                match self { $(Self::$variant(it) => it,)+ Self::Custom(it) => it.get_mut() }
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
