// SPDX-License-Identifier: GPL-3.0-or-later
// A light's view of surfaces that cover all behind them: depth alone, for which nothing need run.
#version 450 core

void main()
{
}
