/* The paper's training in plain C, one sample after the other: what a compiler makes of the obvious code.
 *
 *     gcc -O3 -DREAL=float  -DEXP=expf -o single training.c -lm
 *     gcc -O3 -DREAL=double -DEXP=exp  -o double training.c -lm
 *     ./single 100000
 *
 * 4-8-8-3, 400 samples, batch gradient descent with the adaptive rate of Vogl and others. Prints the CPU
 * seconds of the training and the error it reached.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

typedef REAL real;
enum {
    I = 4, H1 = 8, H2 = 8, O = 3, N = 400,
    W1 = 0, B1 = I * H1, W2 = B1 + H1, B2 = W2 + H1 * H2, W3 = B2 + H2, B3 = W3 + H2 * O, W = B3 + O
};
static real x[N][I], t[N][O];

static real sigmoid(real z) { return 1 / (1 + EXP(-z)); }

static real pass(const real *w, real *g)
{
    real total = 0;
    memset(g, 0, W * sizeof *g);
    for (int n = 0; n < N; n++) {
        real a1[H1], a2[H2], d1[H1], d2[H2], d3[O];
        for (int u = 0; u < H1; u++) {
            real s = w[B1 + u];
            for (int i = 0; i < I; i++) s += w[W1 + u * I + i] * x[n][i];
            a1[u] = sigmoid(s);
        }
        for (int u = 0; u < H2; u++) {
            real s = w[B2 + u];
            for (int i = 0; i < H1; i++) s += w[W2 + u * H1 + i] * a1[i];
            a2[u] = sigmoid(s);
        }
        for (int u = 0; u < O; u++) {
            real s = w[B3 + u];
            for (int i = 0; i < H2; i++) s += w[W3 + u * H2 + i] * a2[i];
            d3[u] = s - t[n][u];
            total += d3[u] * d3[u];
        }
        for (int i = 0; i < H2; i++) {
            real s = 0;
            for (int u = 0; u < O; u++) s += d3[u] * w[W3 + u * H2 + i];
            d2[i] = s * a2[i] * (1 - a2[i]);
        }
        for (int i = 0; i < H1; i++) {
            real s = 0;
            for (int u = 0; u < H2; u++) s += d2[u] * w[W2 + u * H1 + i];
            d1[i] = s * a1[i] * (1 - a1[i]);
        }
        for (int u = 0; u < O; u++) {
            g[B3 + u] += d3[u];
            for (int i = 0; i < H2; i++) g[W3 + u * H2 + i] += d3[u] * a2[i];
        }
        for (int u = 0; u < H2; u++) {
            g[B2 + u] += d2[u];
            for (int i = 0; i < H1; i++) g[W2 + u * H1 + i] += d2[u] * a1[i];
        }
        for (int u = 0; u < H1; u++) {
            g[B1 + u] += d1[u];
            for (int i = 0; i < I; i++) g[W1 + u * I + i] += d1[u] * x[n][i];
        }
    }
    for (int k = 0; k < W; k++) g[k] *= (real)2 / (N * O);
    return total / (N * O);
}

static double uniform(void)
{
    static unsigned long long s = 88172645463325252ull;
    s ^= s << 13; s ^= s >> 7; s ^= s << 17;
    return (s >> 11) / 9007199254740992.0;
}

int main(int argc, char **argv)
{
    int epochs = argc > 1 ? atoi(argv[1]) : 100000;
    for (int n = 0; n < N; n++) {
        for (int i = 0; i < I; i++) x[n][i] = uniform();
        t[n][0] = 0.5 * (x[n][0] + x[n][1] * x[n][2]);
        t[n][1] = 0.5 * (x[n][1] + x[n][3] * x[n][0]);
        t[n][2] = 0.3 / (0.5 + x[n][0] * x[n][2]);
    }
    static real w[W], g[W], v[W], h[W];
    for (int k = 0; k < W; k++) w[k] = 2 * uniform() - 1;
    clock_t start = clock();
    real rate = 0.01, error = pass(w, g);
    for (int e = 0; e < epochs; e++) {
        for (int k = 0; k < W; k++) v[k] = w[k] - rate * g[k];
        real next = pass(v, h);
        if (next > (real)1.04 * error) {
            rate *= 0.7;
            continue;
        }
        if (next < error) rate *= 1.05;
        error = next;
        memcpy(w, v, sizeof w);
        memcpy(g, h, sizeof g);
    }
    printf("{\"seconds\": %.3f, \"error\": %.6e}\n", (double)(clock() - start) / CLOCKS_PER_SEC, (double)error);
}
