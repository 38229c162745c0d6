mod dense;
mod oracle;
mod rules;
