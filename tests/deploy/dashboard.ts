// What Grafana takes as a dashboard, by its own types: grafana_test.py appends the dashboard itself.
import type * as grafana from "@grafana/schema";
import type { Options as StatOptions } from "@grafana/schema/dist/esm/raw/composable/stat/panelcfg/x/StatPanelCfg_types.gen";
import type { Options as TimeSeriesOptions } from "@grafana/schema/dist/esm/raw/composable/timeseries/panelcfg/x/TimeSeriesPanelCfg_types.gen";

// In JSON the value of an enum is its text.
type InJson<T> = T extends string ? `${T}` : T extends object ? { [K in keyof T]: InJson<T[K]> } : T;
// Grafana fills in what a panel leaves out.
type Sparse<T> = T extends object ? { [K in keyof T]?: Sparse<T[K]> } : T;

// Grafana leaves to the kind of panel and to the data source what stands here.
interface PanelOf<Kind extends string, Options, Custom>
  extends Omit<grafana.Panel, "type" | "options" | "fieldConfig" | "targets"> {
  type: Kind;
  options?: Sparse<Options>;
  fieldConfig: { defaults: Omit<grafana.FieldConfig, "custom"> & { custom?: Sparse<Custom> }; overrides: [] };
  targets: (grafana.DataQuery & { expr: string; legendFormat: string })[];
}
type Panel = PanelOf<"stat", StatOptions, never> | PanelOf<"timeseries", TimeSeriesOptions, grafana.GraphFieldConfig>;

export const dashboard: InJson<Omit<grafana.Dashboard, "panels"> & { panels: Panel[] }> =
