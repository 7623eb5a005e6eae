//! Tables of the page.

use crate::text::escape;
use maud::{Markup, html};

/// A table under its name.
pub(crate) fn table(name: &str, heads: &[&str], rows: &[Vec<Markup>]) -> Markup {
    html! {
        div.card {
            h3 { (escape(name)) }
            div.scroll role="region" aria-label=(escape(name)) tabindex="0" {
                table {
                    thead { tr { @for head in heads { th { (escape(head)) } } } }
                    tbody {
                        @for row in rows { tr { @for cell in row { td { (cell) } } } }
                    }
                }
            }
        }
    }
}
