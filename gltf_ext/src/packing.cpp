#include "packing.h"

#include <algorithm>

namespace meshlet {
namespace {

// Groups along the curve that are packed together: best fit, largest first.
constexpr size_t window = 256;

class Packer {
  public:
    Packer(const std::vector<Load>& loads, Load limit) : loads_(loads), limit_(limit), parent_(loads.size()) {
        for (uint32_t i = 0; i < parent_.size(); ++i) parent_[i] = i;
    }

    void join_contacts(std::vector<Contact>& contacts);
    void join_along(const std::vector<uint32_t>& curve_order);
    std::vector<uint32_t> number_groups();

  private:
    uint32_t find(uint32_t item) {
        while (parent_[item] != item) item = parent_[item] = parent_[parent_[item]];
        return item;
    }
    bool fits(uint32_t a, uint32_t b) const {
        return loads_[a].triangles + loads_[b].triangles <= limit_.triangles &&
               loads_[a].vertices + loads_[b].vertices <= limit_.vertices;
    }
    void join(uint32_t a, uint32_t b) {
        if (b < a) std::swap(a, b);
        parent_[b] = a;
        loads_[a].triangles += loads_[b].triangles;
        loads_[a].vertices += loads_[b].vertices;
    }
    // The larger share of a limit that the group takes.
    uint32_t fill(uint32_t group) const {
        return std::max(loads_[group].triangles * limit_.vertices, loads_[group].vertices * limit_.triangles);
    }
    void pack_window(std::vector<uint32_t>& groups);

    std::vector<Load> loads_;
    const Load limit_;
    std::vector<uint32_t> parent_;
};

void Packer::join_contacts(std::vector<Contact>& contacts) {
    std::sort(contacts.begin(), contacts.end(), [](const Contact& x, const Contact& y) {
        if (x.weight != y.weight) return x.weight > y.weight;
        return x.a != y.a ? x.a < y.a : x.b < y.b;
    });
    for (const Contact& contact : contacts) {
        const uint32_t a = find(contact.a), b = find(contact.b);
        if (a != b && fits(a, b)) join(a, b);
    }
}

void Packer::pack_window(std::vector<uint32_t>& groups) {
    std::sort(groups.begin(), groups.end(),
              [&](uint32_t a, uint32_t b) { return fill(a) != fill(b) ? fill(a) > fill(b) : a < b; });
    std::vector<uint32_t> bins;
    for (const uint32_t group : groups) {
        size_t best = bins.size();
        for (size_t i = 0; i < bins.size(); ++i)
            if (fits(bins[i], group) && (best == bins.size() || fill(bins[i]) > fill(bins[best]))) best = i;
        if (best == bins.size()) {
            bins.push_back(group);
        } else {
            join(bins[best], group);
            bins[best] = find(group);
        }
    }
    groups.swap(bins);
}

void Packer::join_along(const std::vector<uint32_t>& curve_order) {
    std::vector<uint32_t> groups;
    for (const uint32_t item : curve_order) {
        if (find(item) != item) continue;
        groups.push_back(item);
        if (groups.size() < 2 * window) continue;
        pack_window(groups);
        // The emptiest groups stay open for what follows.
        if (groups.size() > window) groups.erase(groups.begin(), groups.end() - static_cast<std::ptrdiff_t>(window));
    }
    pack_window(groups);
}

std::vector<uint32_t> Packer::number_groups() {
    std::vector<uint32_t> group(parent_.size());
    uint32_t count = 0;
    for (uint32_t i = 0; i < group.size(); ++i) {
        const uint32_t root = find(i);
        group[i] = root == i ? count++ : group[root];
    }
    return group;
}

}  // namespace

std::vector<uint32_t> pack_meshlets(const std::vector<Load>& loads, std::vector<Contact> contacts,
                                    const std::vector<uint32_t>& curve_order, Load limit) {
    Packer packer(loads, limit);
    packer.join_contacts(contacts);
    packer.join_along(curve_order);
    return packer.number_groups();
}

}  // namespace meshlet
