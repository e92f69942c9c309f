/* An owner of the whole field "c", until its input ends: time 1 in the library's memory, and the same values again, copied. */
#include <slabstream_insitu.h>

#include <stdio.h>
#include <string.h>

enum { kSide = 24 };
static float field[kSide * kSide * kSide];

static int fails(int code) {
  if (code != 0) fprintf(stderr, "owner: %s\n", slabstream_insitu_error());
  return code != 0;
}

int main(void) {
  const int32_t begin[3] = {0, 0, 0}, end[3] = {kSide, kSide, kSide};
  const void* array = field;
  void* memory = NULL;
  slabstream_insitu* owner = NULL;
  slabstream_insitu_field about = {.dataset = "c", .samples = "float32", .size = {kSide, kSide, kSide}, .spacing = {1, 1, 2}};
  for (int i = 0; i < kSide * kSide * kSide; ++i) {
    field[i] = (float)(i % kSide * 4 + i / kSide % kSide * 2 + i / kSide / kSide);
  }
  if (fails(slabstream_insitu_open(&owner, &about)) || fails(slabstream_insitu_add_box(owner, begin, end, NULL, NULL, NULL)) ||
      fails(slabstream_insitu_start(owner)) || fails(slabstream_insitu_begin(owner, 60, &memory, NULL))) {
    return 1;
  }
  memcpy(memory, field, sizeof(field));
  if (fails(slabstream_insitu_commit(owner, 1, 0)) || fails(slabstream_insitu_publish(owner, 2, 0.5, &array, NULL, 60))) return 1;
  printf("%s\n", slabstream_insitu_version());
  fflush(stdout);
  (void)getchar();
  slabstream_insitu_close(owner);
  return 0;
}
