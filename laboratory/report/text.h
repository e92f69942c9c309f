// Formats numbers and texts for reports. Pure.
#pragma once

#include <string>
#include <string_view>

namespace slabstream {

// For XML and HTML, in text and in attribute values: & < > " ' become entities, control characters (which XML forbids) a replacement sign.
std::string Escape(std::string_view text);

// Four significant digits without trailing zeros, such as "0.01234", "12.3", "45678"; from 10^7 on and below 10^-4 with an exponent.
// Not a number or infinite: "–".
std::string FormatNumber(double value);

// Two significant digits, for ratios of low precision: "16000", "1.5".
std::string FormatAbout(double value);

// How a time compares with another, from `before` / `after`: "2.1 times as fast", "1.3 times as slow", and within 2 % "as fast".
std::string FormatSpeed(double ratio);

// "a", "a-b-c" from any text: fit for a file name, an id or a link.
std::string Slug(std::string_view text);

}  // namespace slabstream
