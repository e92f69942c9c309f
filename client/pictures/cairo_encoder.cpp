// PDF and SVG: the pixels as an image, and the annotations over it as shapes and letters. A PDF has its letters as text, in the subset of
// the font that it needs; an SVG has them as outlines, which look the same everywhere.
#include <cairo-ft.h>
#include <cairo-pdf.h>
#include <cairo-svg.h>
#include <ft2build.h>
#include FT_FREETYPE_H

#include <cstring>
#include <memory>
#include <new>

#include "client/pictures/picture_encoder.h"

namespace slabstream {
namespace {

constexpr double kPointsAnInch = 72;

template <auto Destroy>
struct Destroyer {
  void operator()(auto* object) const { Destroy(object); }
};
using Surface = std::unique_ptr<cairo_surface_t, Destroyer<cairo_surface_destroy>>;
using Context = std::unique_ptr<cairo_t, Destroyer<cairo_destroy>>;
using Pattern = std::unique_ptr<cairo_pattern_t, Destroyer<cairo_pattern_destroy>>;
using FontFace = std::unique_ptr<cairo_font_face_t, Destroyer<cairo_font_face_destroy>>;
using FontOptions = std::unique_ptr<cairo_font_options_t, Destroyer<cairo_font_options_destroy>>;

// The bytes of the file, one after the other.
struct ByteSink {
  static cairo_status_t Write(void* closure, const unsigned char* bytes, unsigned count) {
    auto& sink = *static_cast<ByteSink*>(closure);
    sink.ok = sink.ok && sink.write(sink.offset, {reinterpret_cast<const std::byte*>(bytes), count});
    sink.offset += count;
    return sink.ok ? CAIRO_STATUS_SUCCESS : CAIRO_STATUS_WRITE_ERROR;
  }

  const WriteBytes& write;
  std::int64_t offset = 0;
  bool ok = true;
};

// A font of FreeType, with a library of its own: cairo keeps fonts for later pictures, and gives them back on any thread.
struct OpenFont {
  ~OpenFont() {
    FT_Done_Face(face);
    FT_Done_FreeType(library);
  }
  FT_Library library = nullptr;
  FT_Face face = nullptr;
};

// Null: the file is no font.
FontFace OpenFace(const std::string& file) {
  static const cairo_user_data_key_t key{};
  auto font = std::make_unique<OpenFont>();
  if (FT_Init_FreeType(&font->library) != 0 || FT_New_Face(font->library, file.c_str(), 0, &font->face) != 0) return nullptr;
  FontFace face(cairo_ft_font_face_create_for_ft_face(font->face, FT_LOAD_NO_HINTING));
  const auto done = [](void* kept) { delete static_cast<OpenFont*>(kept); };  // NOLINT: cairo knows no owners
  if (cairo_font_face_set_user_data(face.get(), &key, font.get(), done) != CAIRO_STATUS_SUCCESS) throw std::bad_alloc();
  (void)font.release();  // NOLINT: cairo has it
  return face;
}

// Draws marks, in pixels of the picture.
class Painter {
 public:
  explicit Painter(cairo_t* out) : out_(out) {}

  void Paint(const Mark& mark) {
    if (mark.halo > 0) {
      SetColor(mark.halo_color);
      for (const auto& shape : mark.shapes) std::visit([&](const auto& s) { PaintHalo(s, mark.halo); }, shape);
    }
    SetColor(mark.color);
    for (const auto& shape : mark.shapes) std::visit([&](const auto& s) { PaintShape(s); }, shape);
  }

 private:
  void SetColor(const MarkColor& color) { cairo_set_source_rgb(out_, double(color.red), double(color.green), double(color.blue)); }

  void Trace(const Rectangle& shape) {
    cairo_rectangle(out_, shape.begin.x, shape.begin.y, shape.end.x - shape.begin.x, shape.end.y - shape.begin.y);
  }
  void Trace(const Polygon& shape) {
    for (const InkPoint& corner : shape.corners) cairo_line_to(out_, corner.x, corner.y);
    cairo_close_path(out_);
  }
  void Trace(const TextLine& line) {
    MoveTo(line);
    cairo_text_path(out_, line.text.c_str());
  }
  // The text's middle lies where it lies among pixels, where letters have whole pixels between them.
  void MoveTo(const TextLine& line) {
    cairo_set_font_size(out_, line.size);
    cairo_text_extents_t extents{};
    cairo_text_extents(out_, line.text.c_str(), &extents);
    cairo_move_to(out_, line.begin.x + 0.5 * (line.width - extents.x_advance), line.begin.y);
  }

  void PaintHalo(const Stroke& stroke, double halo) { PaintShape(Stroke{stroke.begin, stroke.end, stroke.width + 2 * halo}); }
  void PaintHalo(const Lines& lines, double halo) {
    for (const Stroke& stroke : lines.strokes) PaintHalo(stroke, halo);
  }
  void PaintHalo(const ColorRows& rows, double halo) { PaintHalo(Rectangle{rows.begin, rows.end}, halo); }
  void PaintHalo(const auto& shape, double halo) {
    Trace(shape);
    cairo_set_line_join(out_, CAIRO_LINE_JOIN_ROUND);
    cairo_set_line_width(out_, 2 * halo);
    cairo_stroke_preserve(out_);
    cairo_fill(out_);
  }

  void PaintShape(const Stroke& stroke) {
    cairo_set_line_cap(out_, CAIRO_LINE_CAP_ROUND);
    cairo_set_line_width(out_, stroke.width);
    cairo_move_to(out_, stroke.begin.x, stroke.begin.y);
    cairo_line_to(out_, stroke.end.x, stroke.end.y);
    cairo_stroke(out_);
  }
  void PaintShape(const Lines& lines) {
    for (const Stroke& stroke : lines.strokes) PaintShape(stroke);
  }
  void PaintShape(const TextLine& line) {
    MoveTo(line);
    cairo_show_text(out_, line.text.c_str());
    cairo_new_path(out_);
  }
  void PaintShape(const ColorRows& rows) {
    constexpr std::size_t kMostStops = 256;
    const Pattern gradient(cairo_pattern_create_linear(0, rows.begin.y, 0, rows.end.y));
    const std::size_t count = rows.colors.size(), step = (count + kMostStops - 1) / kMostStops;
    for (std::size_t i = step / 2; i < count; i += step) {
      const MarkColor& color = rows.colors[i];
      cairo_pattern_add_color_stop_rgb(gradient.get(), (double(i) + 0.5) / double(count), double(color.red), double(color.green),
                                       double(color.blue));
    }
    cairo_set_source(out_, gradient.get());
    Trace(Rectangle{rows.begin, rows.end});
    cairo_fill(out_);
  }
  void PaintShape(const auto& shape) {
    Trace(shape);
    cairo_fill(out_);
  }

  cairo_t* out_;
};

// Cairo's pixels: premultiplied, alpha in the highest byte of a word.
std::uint32_t CairoPixel(const std::uint8_t* straight) {
  const std::uint32_t alpha = straight[3];
  const auto premultiplied = [&](int channel) { return (straight[channel] * alpha + 127) / 255; };
  return alpha << 24U | premultiplied(0) << 16U | premultiplied(1) << 8U | premultiplied(2);
}

bool TakeRow(int y, const std::uint8_t* row, int width, cairo_surface_t* image) {
  unsigned char* const out = cairo_image_surface_get_data(image) + std::ptrdiff_t{y} * cairo_image_surface_get_stride(image);
  for (std::ptrdiff_t x = 0; x < width; ++x) {
    const std::uint32_t pixel = CairoPixel(row + 4 * x);
    std::memcpy(out + 4 * x, &pixel, sizeof pixel);
  }
  return true;
}

void Describe(const EncodedFormat& format, cairo_surface_t* page) {
  cairo_pdf_surface_set_metadata(page, CAIRO_PDF_METADATA_CREATE_DATE, "");  // else the time is there, and no two files are the same
  if (format.record.empty()) return;
  cairo_pdf_surface_set_metadata(page, CAIRO_PDF_METADATA_CREATOR, format.software.c_str());
  cairo_pdf_surface_set_metadata(page, CAIRO_PDF_METADATA_SUBJECT, format.record.c_str());
}

}  // namespace

std::optional<std::string> EncodeByCairo(const EncodedFormat& format, const PictureRows& rows, const WriteBytes& write) {
  const Surface image(cairo_image_surface_create(CAIRO_FORMAT_ARGB32, format.width, format.height));
  if (const auto status = cairo_surface_status(image.get())) return cairo_status_to_string(status);
  const auto take = [&](int y, const void* row) { return TakeRow(y, static_cast<const std::uint8_t*>(row), format.width, image.get()); };
  if (!rows(0, format.height, take)) return kBytesNotTaken;
  cairo_surface_mark_dirty(image.get());

  ByteSink sink{write};
  const double points = format.density ? kPointsAnInch / (*format.density * kMetresAnInch) : 1;  // a pixel
  const auto create = format.type == PictureFileType::kPdf ? cairo_pdf_surface_create_for_stream : cairo_svg_surface_create_for_stream;
  const Surface page(create(ByteSink::Write, &sink, points * format.width, points * format.height));
  if (format.type == PictureFileType::kPdf) Describe(format, page.get());
  {
    const Context out(cairo_create(page.get()));
    cairo_scale(out.get(), points, points);
    cairo_set_source_surface(out.get(), image.get(), 0, 0);
    cairo_paint(out.get());
    if (!format.marks.empty()) {
      const FontFace font = OpenFace(format.font);
      if (font == nullptr) return "the font '" + format.font + "' cannot be read";
      cairo_set_font_face(out.get(), font.get());
      const FontOptions options(cairo_font_options_create());
      cairo_font_options_set_hint_style(options.get(), CAIRO_HINT_STYLE_NONE);
      cairo_font_options_set_hint_metrics(options.get(), CAIRO_HINT_METRICS_OFF);
      cairo_set_font_options(out.get(), options.get());
      Painter painter(out.get());
      for (const Mark& mark : format.marks) painter.Paint(mark);
    }
    if (const auto status = cairo_status(out.get())) return cairo_status_to_string(status);
  }
  cairo_surface_finish(page.get());
  if (const auto status = cairo_surface_status(page.get()); status != CAIRO_STATUS_SUCCESS && sink.ok)
    return cairo_status_to_string(status);
  if (!sink.ok) return kBytesNotTaken;
  return std::nullopt;
}

}  // namespace slabstream
