mod interpolation;
mod needle;
