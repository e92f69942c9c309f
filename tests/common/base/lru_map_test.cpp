// An LruMap is compared with a vector of its entries, the last used one first.
#include "common/base/lru_map.h"

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/random.h"

namespace slabstream {
namespace {

// A key with == alone.
struct Unordered {
  int number = 0;
  friend bool operator==(const Unordered&, const Unordered&) = default;
};
struct Ordered {
  int number = 0;
  friend auto operator<=>(const Ordered&, const Ordered&) = default;
};
static_assert(!std::totally_ordered<Unordered> && std::totally_ordered<Ordered>);

// Values that can only be moved.
using Value = std::unique_ptr<std::string>;

template <class Key>
class Model {
 public:
  struct Entry {
    Key key;
    std::string value;
    std::uint64_t weight;
    friend bool operator==(const Entry&, const Entry&) = default;
  };

  std::optional<std::string> Find(const Key& key) {
    const auto found = std::ranges::find(entries, key, &Entry::key);
    if (found == entries.end()) return std::nullopt;
    std::rotate(entries.begin(), found, found + 1);
    return entries.front().value;
  }
  void Put(const Key& key, const std::string& value, std::uint64_t weight) {
    std::erase_if(entries, [&](const Entry& entry) { return entry.key == key; });
    entries.insert(entries.begin(), {key, value, weight});
  }
  void DropBeyond(std::uint64_t most) {
    while (weight() > most && entries.size() > 1) entries.pop_back();
  }
  std::uint64_t weight() const {
    std::uint64_t sum = 0;
    for (const Entry& entry : entries) sum += entry.weight;
    return sum;
  }

  std::vector<Entry> entries;
};

template <class Key>
class LruMapTest : public ::testing::Test {};
using Keys = ::testing::Types<Unordered, Ordered>;
TYPED_TEST_SUITE(LruMapTest, Keys);

TYPED_TEST(LruMapTest, DoesWhatTheModelDoes) {
  using Key = TypeParam;
  Random random(4);
  SCOPED_TRACE(random.trace());
  LruMap<Key, Value> map;
  Model<Key> model;
  for (int turn = 0; turn < 20000; ++turn) {
    const Key key{random.Integer(0, 20)};
    const auto of_number = [&](const auto& entry) { return entry.key.number % 5 == key.number % 5; };
    switch (random.Integer(0, 11)) {
      case 0:
        map.Drop(key);
        std::erase_if(model.entries, [&](const auto& entry) { return entry.key == key; });
        break;
      case 1:
        if (!random.Chance(0.1)) break;
        map.DropIf(of_number);
        std::erase_if(model.entries, of_number);
        break;
      case 2:
        if (!random.Chance(0.02)) break;
        map.Clear();
        model.entries.clear();
        break;
      case 3:
      case 4:
      case 5: {
        const Value* const found = map.Find(key);
        const std::optional<std::string> expected = model.Find(key);
        ASSERT_EQ(found == nullptr, !expected.has_value());
        if (found != nullptr) {
          ASSERT_EQ(**found, *expected);
        }
        break;
      }
      case 6:
        if constexpr (std::totally_ordered<Key>) {
          const Key high{key.number + random.Integer(-1, 3)};
          map.DropBetween(key, high);
          std::erase_if(model.entries, [&](const auto& entry) { return key <= entry.key && entry.key <= high; });
        }
        break;
      default: {
        const std::string text = std::to_string(turn);
        const auto weight = random.Integer<std::uint64_t>(0, 9);
        EXPECT_EQ(*map.Put(key, std::make_unique<std::string>(text), weight), text);
        model.Put(key, text, weight);
        const auto most = random.Integer<std::uint64_t>(0, 60);
        map.DropBeyond(most);
        model.DropBeyond(most);
      }
    }
    ASSERT_EQ(map.weight(), model.weight());
    std::vector<typename Model<Key>::Entry> entries;
    for (const auto& [entry_key, value, weight] : map.entries()) entries.push_back({entry_key, *value, weight});
    ASSERT_EQ(entries, model.entries);
  }
}

TYPED_TEST(LruMapTest, ReturnsWhatItDrops) {
  LruMap<TypeParam, Value> map;
  for (int i = 0; i < 5; ++i) map.Put({i}, std::make_unique<std::string>(std::to_string(i)), 10);
  ASSERT_NE(map.Find({0}), nullptr);
  const auto dropped = map.DropBeyond(30);
  ASSERT_EQ(dropped.size(), 2U);
  EXPECT_EQ(*dropped.front().value, "1");
  EXPECT_EQ(*dropped.back().value, "2");
  EXPECT_EQ(*map.Drop({0}).front().value, "0");
  EXPECT_TRUE(map.Drop({0}).empty());
}

TYPED_TEST(LruMapTest, TheLastUsedOneStaysWhateverItsWeight) {
  LruMap<TypeParam, int> map;
  map.Put({1}, 1, 5);
  map.Put({2}, 2, 1000);
  map.DropBeyond(0);
  EXPECT_EQ(map.Find({1}), nullptr);
  ASSERT_NE(map.Find({2}), nullptr);
}

TYPED_TEST(LruMapTest, AMovedMapFindsItsValues) {
  LruMap<TypeParam, int> map;
  for (int i = 0; i < 9; ++i) map.Put({i}, i);
  LruMap<TypeParam, int> moved = std::move(map);
  ASSERT_NE(moved.Find({4}), nullptr);
  EXPECT_EQ(*moved.Find({4}), 4);
  EXPECT_EQ(moved.weight(), 9U);
}

}  // namespace
}  // namespace slabstream
